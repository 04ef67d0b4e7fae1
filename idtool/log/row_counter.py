"""Rows that a recorder lost while it counted the rest, from the position alone.

A program that writes the number of a row times a period as its time hides every row that it lost: the clock
is perfectly even, and where a row is missing the axis goes twice as far in one step as in those beside it.
Taken as it is, that is an acceleration of the speed over the period, there and back.

How far the axis goes in a step follows from the steps around it by the median of their slopes, which a few
further losses do not move (Theil, Proc. Kon. Ned. Akad. Wet. 53, 1950). Rows are lost where a step is a whole
number of such ways, to within the noise, and a single way stands far out of it. What else makes a step too
long (jerk, stick-slip, a reading that comes late) makes as many too short, or does so at low speeds alone:
the long ones in the faster half must outnumber the short ones by more than chance.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array
from idtool.model.running import deviation

#: A clock whose steps are all this near to one another, as a share, counts rows.
_EVEN = 0.05
#: Steps on either side that say how far the axis goes in one; where losses come close together, more of them.
#: Each pass shows what losses among the steps around hid.
_BESIDE = (3, 3, 5, 5, 3)
#: The quartiles of six to ten normal numbers are so many standard deviations apart.
_APART = 1.3
#: The way of one step stands out of the noise by so many standard deviations, and a step is as many ways as
#: it is taken for to within so many.
_STANDS_OUT = 6.0
_AGREES = 3.0
#: A step of a smaller share of the usual way is no step on.
_BACK = 0.5
#: More rows lost at once are no longer told from a motion.
_MOST = 3
#: Chance of so many steps that are too long, and so few that are too short, where either is as likely.
_CHANCE = 1e-3
#: Ways of less than this share of the longest apart are one; so many alike are a step of the sensor.
_ROUNDING = 1e-9
_AGAIN = 10


def lost_rows(time: Array, first: NDArray[np.bool_], position: Array) -> NDArray[np.intp]:
    """How many rows were lost before each one, shape (rows,); none where the clock is not of a row counter.

    Args:
        time: s, rising inside a trial, shape (rows,).
        first: True at the first row of each trial.
        position: a reading, shape (rows,).
    """
    lost = np.zeros(len(time), dtype=np.intp)
    inside = ~first[1:]
    steps = np.diff(time)[inside]
    if not len(steps) or np.ptp(steps) > _EVEN * float(np.median(steps)):
        return lost
    ways = np.where(inside, np.diff(position), np.nan)
    rounding = _grain(ways) / math.sqrt(6.0)  # of a difference
    long, short = 0, 0
    for beside in _BESIDE:
        periods = 1 + lost[1:]
        rows, way, apart, least = _around(ways / periods, beside)
        noise = np.maximum(max(deviation((ways / periods)[rows] - way), rounding), apart)
        clear = np.abs(way) > _STANDS_OUT * noise
        rows, way, noise, least = rows[clear], way[clear], noise[clear], least[clear]
        whole = np.rint(ways[rows] / way)
        off = ways[rows] - whole * way
        extra = (whole > periods[rows]) & (whole <= 1 + _MOST) & (np.abs(off) < _AGREES * noise)
        extra &= least > _BACK * np.abs(way)  # two rows that changed places come back at once
        lost[rows[extra] + 1] = whole[extra] - 1.0
        # rows are lost at any speed: if so, as many where a way is plainest
        plain = np.abs(way) / noise >= np.median(np.abs(way) / noise) if len(way) else clear[:0]
        long = int(np.count_nonzero(lost[rows[plain] + 1]))
        short = int(np.count_nonzero(whole <= 0.0))
        if not lost.any():
            break
    if _by_chance(long, short) > _CHANCE:
        return np.zeros_like(lost)
    return lost


def _around(ways: Array, count: int) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """Steps with so many others on both sides; of those, without the steady change from one to the next, the
    middle way, their deviation, and the least in the direction of the middle one."""
    padded = np.pad(ways, count, constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * count + 1)
    rows = np.flatnonzero(np.isfinite(windows).all(axis=1))
    beside = np.delete(windows[rows], count, axis=1)
    place = np.delete(np.arange(-count, count + 1.0), count)
    one, other = np.triu_indices(2 * count, 1)
    slopes = (beside[:, other] - beside[:, one]) / (place[other] - place[one])
    beside = np.sort(beside - np.median(slopes, axis=1)[:, None] * place, axis=1)
    middle = beside[:, count - 1 : count + 1].mean(axis=1)
    least = np.where(middle > 0.0, beside[:, 0], -beside[:, -1])
    quarter = count // 2
    return rows, middle, (beside[:, -1 - quarter] - beside[:, quarter]) / _APART, least


def _grain(ways: Array) -> float:
    """The smallest way that comes again and again, as where a sensor has steps; 0 where none does."""
    sizes = np.abs(ways[np.isfinite(ways)])
    rounded = np.rint(sizes / (_ROUNDING * sizes.max(initial=0.0) or 1.0))
    numbers, counts = np.unique(rounded[rounded > 0.0], return_counts=True)
    again = numbers[counts >= _AGAIN]
    return float(again[0] * _ROUNDING * sizes.max()) if len(again) else 0.0


def _by_chance(long: int, short: int) -> float:
    """At most the chance of so many long steps among all that are off (Hoeffding, J. Amer. Stat. Assoc. 58,
    1963)."""
    return math.exp(-0.5 * max(long - short, 0) ** 2 / max(long + short, 1))
