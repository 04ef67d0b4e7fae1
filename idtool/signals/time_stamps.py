"""Noise of readings whose time stamps are not when they were read."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.log.clock import GAP
from idtool.model.motion import Array
from idtool.model.running import deviation
from idtool.signals import kalman
from idtool.signals.readings import Series, unlikely_by

#: Spreads of the time stamps, and by how much louder or quieter the jerk is beside them, that are tried first
#: (decimal logarithms; the spread as a share of the period), and evaluations from the best of them on.
_SPREADS = (-3.0, -2.0, -1.0)
_LOUDER = (-2.0, -1.0, 0.0, 1.0)
_SPENT = 40
#: Most decimals of a stamp that are looked at, and how close to one it is, in units of it.
_DECIMALS = 9
_CLOSE = 1e-3
#: Standard deviations beyond which a step of the clock is none of its usual ones.
_LATE = 5.0


def of_the_clock(
    series: Series, likeliest: float, period: float, passed: kalman.Passed
) -> tuple[float, Array, float]:
    """The jerk, and the variance of both readings from time stamps that are not when they were read.

    A program that asks a drive over a bus notes the time a little before or after the drive read its counter:
    what moves is then off by its speed times that, a noise that is none at rest. Left out it is taken for
    jerk, and the acceleration of a steady motion is noise. The likeliest spread is found together with the
    jerk; the penalised likelihood has to ask for it (Schwarz, Ann. Statist. 6, 1978), and for what is known
    of each stamp: what its last digit leaves open, and how much later than usual it comes after the one
    before, which tells of the program and not of the reading where the drive had read before.

    Args:
        series: the readings, of which only the position is used.
        likeliest: the one intensity of the jerk without such a noise.
        period: s, of the rows.
        passed: is overwritten.

    Returns:
        The one intensity of the jerk, variances of shape (rows, 2), and the standard deviation of the stamps,
        s; 0 if they are right.
    """
    rows = len(series.time)
    jerk = np.full(rows, likeliest)
    kalman.forward(series.time, series.readings, series.variances, series.first, jerk, passed)
    squares = kalman.backward(series.time, series.variances, series.first, passed)[0][:, 1:] ** 2
    stamps = _of_the_last_digit(series.time, series.first), _of_late(series.time, series.first)
    known = [np.zeros_like(squares), *(each[:, None] * squares for each in stamps if each.any())]

    def noise(which: int, spread: float) -> Array:
        return np.asarray(known[which] + squares * (period * 10.0**spread) ** 2)

    def unlikely(which: int, spread: float, louder: float) -> float:
        noisy = np.where(series.variances > 0, series.variances + noise(which, spread), 0.0)
        return unlikely_by(replace(series, variances=noisy), likeliest * 10.0**louder)

    tried = product(range(len(known)), (-math.inf, *_SPREADS), _LOUDER)
    cost = {point: unlikely(*point) for point in tried}
    which, spread, louder = best = min(cost, key=lambda point: cost[point])
    if cost[best] > cost[0, -math.inf, 0.0] - math.log(rows):
        return likeliest, np.zeros_like(squares), 0.0
    if math.isfinite(spread):
        from scipy import optimize  # few recordings have such stamps, and its import takes 0.1 s

        search: Any = optimize.minimize  # its stubs know no method by name
        options = {"maxfev": _SPENT, "xatol": 0.05, "fatol": 0.01 * math.log(rows)}
        point = search(lambda x: unlikely(which, *x), (spread, louder), method="Nelder-Mead", options=options)
        spread, louder = point.x.tolist()
    found = noise(which, spread)
    return likeliest * 10.0**louder, found, float(np.sqrt(found[:, 0].sum() / squares[:, 0].sum()))


def _of_late(time: Array, first: NDArray[np.bool_]) -> Array:
    """Square of how much later than usual each stamp comes after the one before, s^2, shape (rows,); nothing
    where that is usual, and after a gap, in which rows are missing."""
    step = np.diff(time, prepend=time[0])
    inside = step[~first]
    usual = float(np.median(inside))
    late = np.where(first | (step > GAP * usual), 0.0, step - usual)
    return np.where(late > _LATE * deviation(inside - usual), late, 0.0) ** 2


def _of_the_last_digit(time: Array, first: NDArray[np.bool_]) -> Array:
    """Variance of the time stamps from rounding, s^2, shape (rows,); even ones are exact. Where a program
    writes so many digits in all, the last one counts ten times as much from each power of ten on."""
    power = np.floor(np.log10(np.maximum(np.abs(time), 1.0)))
    starts = np.flatnonzero(first | (np.diff(power, prepend=power[0]) != 0.0))
    ends = np.append(starts[1:], len(time))
    variance, seen = np.zeros(len(starts)), np.zeros(len(starts), dtype=bool)
    for decimals in range(_DECIMALS):
        counted = np.rint(time * 10.0**decimals)
        whole = np.logical_and.reduceat(np.abs(time * 10.0**decimals - counted) < _CLOSE, starts) & ~seen
        uneven = np.diff(counted, 2, prepend=0.0, append=0.0) != 0.0
        uneven[starts] = uneven[ends - 1] = False
        found = whole & np.logical_or.reduceat(uneven, starts)
        variance[found] = 10.0 ** (-2 * decimals) / 12.0
        seen |= whole
    return np.repeat(variance, ends - starts)
