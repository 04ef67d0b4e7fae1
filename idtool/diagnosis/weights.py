"""What a row is worth where a model leaves more at low speed than in motion.

Friction near standstill follows no law as closely as sliding does: a real axis may leave five times as much
there, and where it creeps before it slides as much as all of its friction. Where all rows count the same,
what the few slow ones leave hides what the moving ones tell and pulls at every parameter. So rows count by
the inverse of what is left at their speed, as in feasible generalised least squares (Greene, Econometric
Analysis, 7th ed., 2012, ch. 9); the variance is a step function that never rises with the speed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.signals import Recording

#: A row is slow below this share of the usual top speed, slower below a third of that, and so on.
_SLOW, _SLOWER, _STEPS = 0.05, 3.0, 4
#: Rows are weighed where plain least squares gets no more from them than weighed ones get from this share.
_WASTEFUL = 0.8
#: Fewer rows than this tell no variance.
_FEWEST = 20


def weighed(recording: Recording, fit: JointFit) -> Recording:
    """The recording with weights for its rows by their speed, or itself where they change little.

    Args:
        recording: all rows, as they count now.
        fit: the best model so far, of some of them.
    """
    known = fit.model.recording
    speed = np.abs(known.motion.velocity)
    top = float(np.quantile(speed, 0.98))
    limits = _limits(speed[known.row], top)
    if not len(limits):
        return recording
    group = np.searchsorted(limits, speed[known.row], side="right")
    count = np.bincount(group)
    variance = _never_rising(np.bincount(group, (fit.residual / known.row_weight) ** 2) / count, count)
    share, best = count / len(group), 1.0 / variance
    for now in (recording, replace(recording, weight=None)):
        squares = known.row_weight**2 if now.weight is not None else np.ones(len(group))
        counted = np.bincount(group, squares) / count
        # of rows in groups, the information of these weights over that of the best ones
        cost = float(share @ (counted**2 * variance)) * float(share @ best)
        if float(share @ counted) ** 2 > _WASTEFUL * cost:
            return now
    # as many rows as there are
    weight = np.sqrt(best / float(share @ best))
    rows = weight[np.searchsorted(limits, np.abs(recording.motion.velocity), side="right")]
    return replace(recording, weight=rows)


def _limits(speed: Array, top: float) -> Array:
    """Speeds that part the rows into groups of which each is large enough, slowest first; none if only one
    is."""
    found: list[float] = []
    for limit in top * _SLOW * _SLOWER ** -np.arange(_STEPS, dtype=float)[::-1]:
        between = (speed >= (found[-1] if found else 0.0)) & (speed < limit)
        if np.count_nonzero(between) >= _FEWEST:
            found.append(float(limit))
    return np.array(found if np.count_nonzero(speed >= top * _SLOW) >= _FEWEST else [])


def _never_rising(values: Array, count: NDArray[np.intp]) -> Array:
    """Means of neighbours wherever a value is above the one before it, each by its count."""
    blocks: list[tuple[float, int, int]] = []
    for value, rows in zip(values.tolist(), count.tolist(), strict=True):
        blocks.append((value, rows, 1))
        while len(blocks) > 1 and blocks[-1][0] > blocks[-2][0]:
            (a, m, j), (b, n, k) = blocks[-2:]
            blocks[-2:] = [((a * m + b * n) / (m + n), m + n, j + k)]
    return np.concatenate([np.full(k, value) for value, _, k in blocks])
