"""Faults of sensors that can be told from the readings alone: wrapped, saturated and stuck ones."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array
from idtool.model.running import deviation, running_median

_TURN = 2.0 * math.pi
#: A jump between two rows is a wrap if, a whole turn taken off, this share of a turn at most is left.
_LEFT_OF_A_TURN = 0.2
_SURPLUS = 0.01
#: The same for any one jump: a reading that is off by about a turn for some rows does not wrap.
_MOST_SURPLUS = 0.05
#: Equal readings in a row, at the extreme, that make a clipped stretch; rows in all such stretches.
_CLIPPED_RUN = 3
_CLIPPED_ROWS = 10
#: A clipped reading piles up at its limit: this many times the rows at any of so many values below it.
#: Without noise the peak of a sine piles up too, 2.4 times the rows at the value below.
_PILE = 1.5
_QUIET_PILE = 3.0
_LEVELS = 5
#: Rows whose median over so many lies within so many standard deviations of the limit are clipped too.
_NEIGHBOURS = 11
_NOISE = 3.0
#: Equal readings in a row that can be a stuck sensor.
_STUCK_ROWS = 20
#: A stuck sensor disagrees with the other by this share of the travel, this share of the stroke, this many
#: steps of the position, and the travel at this share of the top speed.
_DISAGREE = 0.3
_DISAGREE_STROKE = 0.02
_DISAGREE_STEPS = 5.0
_OFFSET = 0.02
#: A step below this share of what is read is rounding.
_ROUNDING = 1e-12


def unwrap(position: Array, first: NDArray[np.bool_]) -> tuple[Array, int]:
    """An angle made continuous where it wraps by whole turns, and how many wraps there were.

    Args:
        position: rad, shape (rows,).
        first: True at the first row of each trial.

    Returns:
        The angle and the number of wraps inside trials; the angle as it was if there are none.
    """
    jump = np.diff(position, prepend=position[:1])
    turns = np.round(jump / _TURN)
    rest = jump - turns * _TURN
    # what is left of a jump is the motion of that step, much as that of the step before; otherwise the
    # range of the reading is no whole number of turns, and who knows what it is
    surplus = np.abs(np.diff(rest, prepend=0.0))
    near = first | (surplus < _MOST_SURPLUS * _TURN)
    wraps = (turns != 0) & (np.abs(rest) < _LEFT_OF_A_TURN * _TURN) & near
    inside = np.flatnonzero(wraps & ~first)
    if not len(inside) or float(np.median(surplus[inside])) > _SURPLUS * _TURN:
        return position, 0
    # between trials the axis was brought somewhere; only within less than half a turn can that be told
    return position - _TURN * np.cumsum(np.where(wraps, turns, 0.0)), len(inside)


def clipped(values: Array) -> NDArray[np.bool_]:
    """Rows at which a reading sits at the end of its range, or so close that noise is cut off, (rows,).

    A reading that stays exactly at its extreme for several rows, again and again, while hardly any lie
    just below: noise and steps of a sensor that is not at its limit spread over several values.
    """
    result = np.zeros(len(values), dtype=bool)
    if values.min() == values.max():  # nothing lies below its extreme
        return result
    extremes = np.isin(values, (values.min(), values.max()))
    # a quiet sensor repeats itself everywhere, not only at its extreme
    repeats = _lengths(np.concatenate([[False], np.diff(values) == 0]) & ~extremes).max(initial=0)
    pile = _PILE if _noisy(values[~extremes]) else _QUIET_PILE
    for at in (values == values.max(), values == values.min()):
        lengths = _lengths(at)
        if values[at][0] == 0.0:  # no range ends at nothing
            continue
        if lengths.max() < max(_CLIPPED_RUN, 2 * repeats + 1) or at.sum() < _CLIPPED_ROWS:
            continue
        # the values just below the extreme: noise, or the peak of a sine, is on them as often
        away = np.abs(values[~at] - values[at][0])
        counts = np.unique(away[away <= np.quantile(away, 0.5)], return_counts=True)[1]
        if at.sum() > pile * counts[:_LEVELS].max(initial=0):
            # rows that noise kept from the limit would pull a mean away from it
            away = np.abs(running_median(values, _NEIGHBOURS, beyond=0.0) - values[at][0])
            result |= at | (away < _NOISE * _noise(values[~extremes]))
    return result


def _noise(values: Array) -> float:
    """Standard deviation of white noise on a reading, from its third differences."""
    return deviation(np.diff(values, 3)) / math.sqrt(20.0)


def _noisy(values: Array) -> bool:
    """Whether a reading goes up and down from row to row: white noise makes its steps alternate."""
    steps = np.diff(values)
    power = float(steps @ steps)
    return power > 0.0 and float(steps[1:] @ steps[:-1]) < -0.2 * power


def stuck(
    time: Array, position: Array, velocity: Array, first: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows at which the position, and at which the velocity, repeats itself while the other moves on.

    Args:
        time: s, shape (rows,).
        position, velocity: readings, shape (rows,).
        first: True at the first row of each trial.

    Returns:
        Two masks, shape (rows,).
    """
    step = np.where(first, 0.0, np.diff(time, prepend=time[:1]))
    mean = 0.5 * (velocity + np.concatenate([velocity[:1], velocity[:-1]]))
    travel = np.cumsum(np.where(first, 0.0, mean * step))
    tolerance = _DISAGREE_STROKE * min(float(np.ptp(travel)) + 1e-300, _TURN)
    runs: list[list[tuple[int, int]]] = [[], []]
    steps = [resolution(position), resolution(velocity)]
    # a velocity at rest may read a little: the zero of many sensors is off
    slow = max(steps[1], _OFFSET * float(np.quantile(np.abs(velocity), 0.999)))
    for which, reading in enumerate((position, velocity)):
        for begin, end in _repeats(reading, first):
            by_position = position[begin:end] - position[begin]
            by_velocity = travel[begin:end] - travel[begin]
            apart = float(np.max(np.abs(by_position - by_velocity)))
            moved = max(float(np.max(np.abs(by_position))), float(np.max(np.abs(by_velocity))))
            drift = _DISAGREE_STEPS * steps[0] + float(time[end - 1] - time[begin]) * slow
            if apart > max(_DISAGREE * moved, tolerance, drift):
                runs[which].append((begin, end))
    masks = np.zeros((2, len(time)), dtype=bool)
    for which in range(2):
        for begin, end in runs[which]:
            # where both repeat themselves, the one that does so for longer is at fault
            rivals = [b - a for a, b in runs[1 - which] if a < end and begin < b]
            longer = end - begin > max(rivals, default=0) or (which == 0 and end - begin in rivals)
            if longer:
                masks[which, begin + 1 : end] = True  # the first of them was read
    return masks[0], masks[1]


def repeated(values: Array, first: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows of long stretches of equal readings, shape (rows,)."""
    rows = np.zeros(len(values), dtype=bool)
    for begin, end in _repeats(values, first):
        rows[begin:end] = True
    return rows


def _repeats(values: Array, first: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """(first row, row after the last) of each long stretch of equal readings of one trial."""
    changes = np.flatnonzero((np.diff(values) != 0) | first[1:]) + 1
    bounds = np.concatenate([[0], changes, [len(values)]])
    long = np.flatnonzero(np.diff(bounds) >= _STUCK_ROWS)
    return list(zip(bounds[long].tolist(), bounds[long + 1].tolist(), strict=True))


def _lengths(flags: NDArray[np.bool_]) -> NDArray[np.intp]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return np.asarray(edges[1::2] - edges[::2], dtype=np.intp)


def resolution(values: Array | None) -> float:
    """The smallest step of a reading; 0 without one, or if it never changes."""
    if values is None:
        return 0.0
    values = values[np.isfinite(values)]
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0.0]
    if len(steps) and steps.min() <= _ROUNDING * (1.0 + np.abs(values).max()):
        # of the usual size: one reading of 1e30 must not make every step look like rounding
        steps = steps[steps > _ROUNDING * (1.0 + np.median(np.abs(values)))]
    return float(np.quantile(steps, 0.01)) if len(steps) else 0.0
