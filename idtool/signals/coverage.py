"""What the motion of a recording covers: directions, tilts and constant speeds."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from idtool.effects.base import OTHER_WAY
from idtool.model.motion import Array, Motion
from idtool.signals.recording import Recording

#: Speeds above this share of the highest are motion.
MOVING = 0.05
#: Gravity acts alike where the cosine of the tilt changes by less than this.
_TILTED = 0.1
#: Shortest stretch of constant speed that counts, s.
_STEADY_S = 0.4


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


def constant_speeds(motion: Motion, rows: NDArray[np.bool_] | None = None) -> list[tuple[float, float]]:
    """(speed, travel) of each stretch of constant speed, from the smoothed velocity alone."""
    chosen = np.ones(len(motion), dtype=bool) if rows is None else rows
    w, time, trial = motion.velocity[chosen], motion.time[chosen], motion.trial[chosen]
    top = float(np.quantile(np.abs(w), 0.999))
    bins = np.round(w / (0.04 * top)).astype(int)
    edges = np.flatnonzero((np.diff(bins) != 0) | (np.diff(trial) != 0)) + 1
    bounds = np.concatenate([[0], edges, [len(w)]])
    windows = []
    for begin, end in pairwise(bounds.tolist()):
        seconds = float(time[end - 1] - time[begin])
        speed = float(np.mean(w[begin:end]))
        if seconds >= _STEADY_S and abs(speed) > MOVING * top:
            windows.append((speed, abs(speed) * seconds))
    return windows


def slowest_and_fastest(recording: Recording) -> tuple[float, float]:
    """The slowest constant speed (the highest speed if none is constant) and the highest speed."""
    speed: Array = np.abs(recording.motion.velocity)
    fastest = float(np.quantile(speed, 0.999))
    slow = [abs(w) for w, _ in constant_speeds(recording.motion)]
    return min(slow, default=fastest), fastest


def stretches(flags: NDArray[np.bool_], motion: Motion) -> list[tuple[int, int]]:
    """(first row, row after the last) of each stretch of flagged rows of one trial."""
    broken = (np.diff(flags.astype(int)) != 0) | (np.diff(motion.trial) != 0)
    bounds = np.concatenate([[0], np.flatnonzero(broken) + 1, [len(flags)]])
    return [(begin, end) for begin, end in pairwise(bounds.tolist()) if flags[begin]]
