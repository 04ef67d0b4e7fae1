"""What the motion of a recording covers: directions, tilts and constant speeds."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import MOVING, OTHER_WAY
from idtool.model.motion import Array, Motion
from idtool.model.running import running_mean
from idtool.signals.recording import Recording

#: Gravity acts alike where the cosine of the tilt changes by less than this.
_TILTED = 0.1
#: The shortest stretch of constant speed that counts, in time and in usable rows; these are that share of it.
_LEAST_SECONDS, _LEAST_ROWS, _MOSTLY = 0.4, 20, 0.5
#: A speed is constant while its mean over this long changes by less than this share.
_SETTLING_S, _CHANGE = 0.25, 0.05


def constant_tilt(motion: Motion) -> bool:
    """Whether gravity acts alike all the time, as far as the tilt goes."""
    return motion.gravity_factor is None or float(np.ptp(motion.gravity_factor)) < _TILTED


def moves_one_way(recording: Recording) -> bool:
    """Whether the axis moves in one direction only."""
    velocity = recording.motion.velocity[recording.usable]
    fast = velocity[np.abs(velocity) > MOVING * float(np.quantile(np.abs(velocity), 0.999))]
    forward = float(np.mean(fast > 0)) if len(fast) else 0.0
    return min(forward, 1.0 - forward) < OTHER_WAY


def turning_points(position: Array, least: float) -> list[int]:
    """Rows at which the axis turns round between ways of more than `least` each, rad (m)."""
    turns: list[int] = []
    places = position.tolist()
    highest = lowest = going = 0
    for row, place in enumerate(places):
        highest = row if place > places[highest] else highest
        lowest = row if place < places[lowest] else lowest
        if going >= 0 and places[highest] - place > least:
            turns += [highest] if going else []
            going, lowest = -1, row
        elif going <= 0 and place - places[lowest] > least:
            turns += [lowest] if going else []
            going, highest = 1, row
    return turns


def slowest_speed(recording: Recording) -> float:
    """The lowest speed at which the axis moves for certain; 0 where it never does."""
    moving = np.abs(recording.motion.velocity[recording.moving])
    return float(np.quantile(moving, 0.02)) if len(moving) else 0.0


def steady_stretches(recording: Recording) -> list[tuple[int, int]]:
    """(first row, row after the last) of each stretch of constant speed, in order of time."""
    motion = recording.motion
    speed = np.abs(motion.velocity)
    steady = (_change_of_speed(motion) < _CHANGE * speed) & (speed > 0.5 * slowest_speed(recording))
    found = (
        part for way in (1.0, -1.0) for part in stretches(steady & (way * motion.velocity > 0.0), motion)
    )
    return sorted(part for part in found if long_enough(recording, *part))


def long_enough(recording: Recording, begin: int, end: int) -> bool:
    """Whether rows from `begin` to before `end` make a stretch that counts."""
    rows = int(np.count_nonzero(recording.usable[begin:end]))
    if rows < max(_LEAST_ROWS, _MOSTLY * (end - begin)):
        return False
    return float(recording.motion.time[end - 1] - recording.motion.time[begin]) >= _LEAST_SECONDS


def _change_of_speed(motion: Motion) -> Array:
    """By how much the mean speed changes around each row, noise averaged out, (rows,)."""
    rows = max(round(_SETTLING_S / motion.period) // 2, 2)
    mean = running_mean(motion.velocity, rows)
    row = np.arange(len(mean))
    return np.asarray(np.abs(mean[np.minimum(row + rows, len(mean) - 1)] - mean[np.maximum(row - rows, 0)]))


def constant_speeds(recording: Recording) -> list[float]:
    """The mean velocity of each stretch of constant speed."""
    return [float(np.mean(recording.motion.velocity[slice(*part)])) for part in steady_stretches(recording)]


def fastest_speed(recording: Recording) -> float:
    """The highest speed, but for a few rows."""
    return float(np.quantile(np.abs(recording.motion.velocity), 0.999))


def stretches(flags: NDArray[np.bool_], motion: Motion) -> list[tuple[int, int]]:
    """(first row, row after the last) of each stretch of flagged rows of one trial."""
    broken = (np.diff(flags.astype(int)) != 0) | (np.diff(motion.trial) != 0)
    bounds = np.concatenate([[0], np.flatnonzero(broken) + 1, [len(flags)]])
    return [(begin, end) for begin, end in pairwise(bounds.tolist()) if flags[begin]]
