"""Where the axis stands: rows at which friction is an inequality, not a prediction.

Below break-away the torque at rest is whatever the drive happens to push with, anywhere between the two
static levels. Such rows bound friction and say nothing else of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array, Motion
from idtool.model.running import running_mean
from idtool.signals.smoother import reading_variance

#: The axis stands where its position keeps within this many grains of its reading ...
_GRAINS = 1.5
#: ... and within this share of the stroke, over this long, s.
_SHARE = 2e-5
_WINDOW_S = 0.5
#: Where the torque swings by this share of what moves the axis and the position shows nothing, the bristle
#: is deflected by less than the position can hide: nothing is known of it until the axis leaves.
_SWING = 1.0
#: Rows over which the torque is averaged for that, against its noise.
_CALMED = 15


def standing(motion: Motion, reading: Array | None, torque: Array) -> tuple[NDArray[np.bool_], float]:
    """Rows at which the axis stands, as far as its sensor can tell, and how far it may move unseen.

    Args:
        motion: the smoothed motion.
        reading: the position as it was read, shape (rows,); None where it was not logged, and nothing is
            said to stand then.
        torque: as measured, shape (rows,).

    Returns:
        The rows, shape (rows,), and the distance, rad (m).
    """
    still, near = np.zeros(len(motion), dtype=bool), np.zeros(len(motion), dtype=bool)
    if reading is None:
        return still, 0.0
    grain = np.sqrt(12.0 * reading_variance(reading, motion.first))
    limit = max(_GRAINS * grain, _SHARE * float(np.ptp(motion.position)))
    for begin, end in zip(motion.starts, motion.ends, strict=True):
        clock, position = motion.time[begin:end], motion.position[begin:end]
        before = np.searchsorted(clock, clock - 0.5 * _WINDOW_S)
        after = np.searchsorted(clock, clock + 0.5 * _WINDOW_S, side="right") - 1
        whole = (clock - 0.5 * _WINDOW_S >= clock[0]) & (clock + 0.5 * _WINDOW_S <= clock[-1])
        # the ends of a trial are judged by the half of the window that is there
        half = np.maximum(np.abs(position[after] - position), np.abs(position - position[before]))
        reach = np.where(whole, np.maximum(half, np.abs(position[after] - position[before])), half)
        found = reach < np.where(whole, limit, 0.5 * limit)
        edges = np.zeros(len(clock) + 1, dtype=int)
        np.add.at(edges, before[found], 1)
        np.add.at(edges, after[found] + 1, -1)
        still[begin:end], near[begin:end] = found, np.cumsum(edges[:-1]) > 0
    return still | _unwitnessed(near, torque, motion.first), limit


def _unwitnessed(near: NDArray[np.bool_], torque: Array, first: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Of the rows within a window of standing, those of rests in which the torque swings unseen."""
    if not near.any() or near.all():
        return near
    begins = near & (first | ~np.append(False, near[:-1]))
    rest = np.cumsum(begins) - 1
    torque = running_mean(torque, _CALMED, mirrored=True)
    most, least = np.full(begins.sum(), -np.inf), np.full(begins.sum(), np.inf)
    np.maximum.at(most, rest[near], torque[near])
    np.minimum.at(least, rest[near], torque[near])
    blind = most - least > _SWING * float(np.median(np.abs(torque[~near])))
    return np.asarray(near & blind[rest])
