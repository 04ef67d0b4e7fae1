"""What a row is worth where a model leaves more at low speed than in motion.

Friction near standstill follows no law as closely as sliding does: a real axis may leave five times as much
there. Where all rows count the same, what the few slow ones leave hides what the moving ones tell and pulls
at every parameter. So each of the two kinds counts by the inverse of what it leaves, as in feasible
generalised least squares (Greene, Econometric Analysis, 7th ed., 2012, ch. 9).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from idtool.fit.joint import JointFit
from idtool.signals import Recording

#: A row is slow below this share of the usual top speed.
_SLOW = 0.05
#: Rows are weighed where plain least squares gets no more from them than weighed ones get from this share.
_WASTEFUL = 0.8
#: Fewer slow rows than this tell no variance.
_FEWEST = 20


def weighed(recording: Recording, fit: JointFit) -> Recording:
    """The recording with weights for its slow rows and for the others, or itself where they change little.

    Args:
        recording: all rows, as they count now.
        fit: the best model so far, of some of them.
    """
    known = fit.model.recording
    limit = _SLOW * float(np.quantile(np.abs(known.motion.velocity), 0.98))
    slow = np.abs(known.motion.velocity[known.row]) < limit
    if min(np.count_nonzero(slow), np.count_nonzero(~slow)) < _FEWEST:
        return recording
    left = (fit.residual / known.row_weight) ** 2
    variance = np.array([np.mean(left[~slow]), np.mean(left[slow])])
    if variance[1] < variance[0]:
        variance[:] = np.mean(left)
    share = np.array([np.mean(~slow), np.mean(slow)])
    best = 1.0 / variance
    for now in (recording, replace(recording, weight=None)):
        squares = known.row_weight**2 if now.weight is not None else np.ones(len(slow))
        counted = np.array([np.mean(squares[~slow]), np.mean(squares[slow])])
        # of two groups of rows, the information of these weights over that of the best ones
        cost = float(share @ (counted**2 * variance)) * float(share @ best)
        if float(share @ counted) ** 2 > _WASTEFUL * cost:
            return now
    # as many rows as there are
    weight = np.sqrt(best / float(share @ best))
    rows = np.where(np.abs(recording.motion.velocity) < limit, weight[1], weight[0])
    return replace(recording, weight=rows)
