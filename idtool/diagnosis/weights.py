"""What a row is worth where a model leaves more at low speed, or where the motion is less sure.

Friction near standstill follows no law as closely as sliding does: a real axis may leave five times as much
there, and where it creeps before it slides as much as all of its friction. And where an axis is thrown about,
its acceleration is known much worse than where it glides: readings that are coarse, or not quite of the
instant of their stamp, tell it with an error that the smoother knows, and inertia makes torque of that. Where
all rows count the same, what such few leave hides what the others tell and pulls at every parameter. So rows
count by the inverse of what is left on their like, as in feasible generalised least squares (Greene,
Econometric Analysis, 7th ed., 2012, ch. 9); the variance is a step function that never rises with the speed,
and in motion never falls with the uncertainty of the acceleration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.signals import Recording

#: A row is slow below 5 % of the usual top speed, slower below a third of that, and so on.
_SLOW_LIMITS = np.array([0.05 / 27.0, 0.05 / 9.0, 0.05 / 3.0, 0.05])
#: A moving one is unsure where the error of its acceleration is half a noise of torque, more so at
#: twice that, and so on.
_SIZES = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0])
#: Rows are weighed where plain least squares gets no more from them than weighed ones get from this share.
_WASTEFUL = 0.8
#: Fewer rows than this tell no variance.
_FEWEST = 20


def weighed(recording: Recording, fit: JointFit, *, unsure: bool = True) -> Recording:
    """The recording with weights for its rows by what is left on their like; itself if they change little.

    Args:
        recording: all rows, as they count now.
        fit: the best model so far, of some of them.
        unsure: whether rows count by how sure their acceleration is; under a model that somebody chose they
            count as in any published fit.
    """
    known = fit.model.recording
    kinds = _kinds(fit, unsure=unsure)
    group = kinds.of(known)[known.row]
    if not group.any():
        return recording
    count = np.bincount(group)
    passed = kinds.inertia * fit.model.filtered_noise / known.noise
    noise = np.zeros(len(group)) if known.unsure is None else (passed * known.unsure[known.row]) ** 2
    left = (fit.residual / known.row_weight) ** 2
    left, noise = (np.bincount(group, each) / count for each in (left, noise))
    variance = kinds.smoothed(left, noise, count)
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
    return replace(recording, weight=weight[kinds.of(recording)])


@dataclass(frozen=True)
class _Kinds:
    """Kinds of rows, by limits that rise: slow ones by their speed, then the others by how much torque the
    uncertainty of their acceleration is."""

    speeds: Array
    sizes: Array
    inertia: float

    def of(self, recording: Recording) -> NDArray[np.intp]:
        """The kind of every row, slowest first, then those of which the motion is surest."""
        slow = np.searchsorted(self.speeds, np.abs(recording.motion.velocity), side="right")
        if recording.unsure is None:
            return slow
        unsure = np.searchsorted(self.sizes, self.inertia * recording.unsure, side="right")
        return np.where(slow < len(self.speeds), slow, slow + unsure)

    def smoothed(self, variance: Array, noise: Array, count: NDArray[np.intp]) -> Array:
        """Variances that never rise with the speed, nor fall with the uncertainty where that explains them:
        where less sure rows leave more than it can be, the model lacks something, and all count the same."""
        slow, moving = np.split(variance, [len(self.speeds)])
        few, many = np.split(count, [len(self.speeds)])
        whole = float(moving @ many) / max(int(many.sum()), 1)
        slow = _never_rising(np.append(slow, whole), np.append(few, many.sum()))[:-1]
        rising = _never_rising(moving[::-1], many[::-1])[::-1]
        more = many @ (rising - rising[0])
        sure = more <= many @ np.where(rising > rising[0], noise[len(self.speeds) :], 0.0)
        return np.append(slow, rising if sure else np.full(len(rising), whole))


def _kinds(fit: JointFit, *, unsure: bool) -> _Kinds:
    """Kinds of which each has rows enough to tell its variance."""
    known = fit.model.recording
    speed = np.abs(known.motion.velocity)
    top = float(np.quantile(speed, 0.98))
    speeds = _filled(top * _SLOW_LIMITS, speed[known.row])
    inertia = fit.values.get("inertia.inertia", 0.0)
    sizes = np.empty(0)
    if unsure and known.unsure is not None and inertia > 0.0:
        moving = known.row[speed[known.row] >= speeds[-1]] if len(speeds) else known.row
        sizes = _filled(known.noise * _SIZES, inertia * known.unsure[moving])
    return _Kinds(speeds, sizes, inertia)


def _filled(limits: Array, values: Array) -> Array:
    """Those of rising limits that part the values into groups of which each is large enough."""
    found: list[float] = []
    for limit in limits.tolist():
        between = (values >= (found[-1] if found else -np.inf)) & (values < limit)
        if np.count_nonzero(between) >= _FEWEST and np.count_nonzero(values >= limit) >= _FEWEST:
            found.append(limit)
    return np.array(found)


def _never_rising(values: Array, count: NDArray[np.intp]) -> Array:
    """Means of neighbours wherever a value is above the one before it, each by its count."""
    blocks: list[tuple[float, int, int]] = []
    for value, rows in zip(values.tolist(), count.tolist(), strict=True):
        blocks.append((value, rows, 1))
        while len(blocks) > 1 and blocks[-1][0] > blocks[-2][0]:
            (a, m, j), (b, n, k) = blocks[-2:]
            blocks[-2:] = [((a * m + b * n) / (m + n), m + n, j + k)]
    return np.concatenate([np.full(k, value) for value, _, k in blocks])
