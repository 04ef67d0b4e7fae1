"""Position, velocity and acceleration from noisy, quantised readings: a zero-phase Kalman smoother.

State (q, w, a) driven by white jerk; measured: position, velocity or both. The estimates at the sample
instants lag nothing and work at uneven sample times. How loud the jerk is, is found from the data: first
one intensity for all rows, the likeliest; then for every row its own, so that a steady stretch is averaged
long and a reversal is followed. A counter that turns slowly is read at its edges; a single velocity that
the position denies is not used: a bristle would take it for a reversal. Where the model of the
readings holds, regressors computed from such estimates bias a regression hardly at all, unlike those from
any one filter. Innovations beyond a few standard deviations mark rows where the axis moved faster than
the sampling shows.

Source: Rauch, Tung & Striebel, AIAA J. 3(8), 1965; Durbin & Koopman, Time Series Analysis by State
Space Methods, 2nd ed. 2012; the local intensities are MacKay's fixed point (Neural Comput. 4, 1992).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idtool.log.sensor_faults import resolution
from idtool.model.motion import Array
from idtool.model.running import deviation
from idtool.signals import kalman
from idtool.signals.readings import ANYWHERE, NEAR, Series, likeliest_jerk
from idtool.signals.time_stamps import of_the_clock

#: The readings are judged under a jerk louder than likeliest by this factor, and much louder around rows
#: with more than this surprise (they and so many neighbours, up to this factor squared): what is still
#: surprising then, is no matter of smoothing.
_EAGER = 10.0
_SURPRISING = 9.0
_REACH = 3
_ROUGHEST = 100.0
#: Squared normalised innovation above which the motion was faster than its sampling.
TOO_FAST = 25.0
#: If more rows than this are, it is not the motion: the reading is worse than its steps suggest. Its variance
#: is raised by this factor, so many times at most.
_DOUBTFUL = 0.03
_DOUBT = 10.0
_MOST_DOUBTS = 4
#: A velocity with which so much more of the rows surprise than without it, under the jerk that the position
#: alone asks for or that both do, is none of this motion: drives compute it late, through a filter. Where
#: readings are what their steps and noise say that is 0.0005 at most (simulated sessions, a servo's sensors
#: too), elsewhere 0.009 to 0.7.
_CONTRADICTED = 0.003
#: A velocity whose noise, beside the position alone, has so many times the variance that third differences
#: say (twice the standard deviation) was low-passed. It is 0.6 to 2.8 times where readings came as they were
#: taken (servos, arms, simulated sessions), 7 to 2000 after low-passes at 10 to 30 Hz.
_COLOURED = 4.0
#: Local intensities: rounds of the fixed point, half width of the window in smoothing times, what counts
#: as one more piece of evidence for leaving the intensity as it is, and the range about the global one.
_ROUNDS = 4
_WINDOW = 24.0
_INERTIA = 1.0
_QUIETEST = 1e-4
_LOUDEST = 1e6
#: The axis stands still where its position keeps within one grain over any stretch of this long, s. A stiff
#: bristle forgets its deflection over a travel that noise of the velocity adds up to; a slow reversal, which
#: is none, takes less.
_REST_S = 1.0
#: A velocity above so many grains a second is motion: the slow start of a ramp is none of the rest before it.
_MOVING = 2.5
#: How far the edges of a counter may lie from where they should, in counts.
_EDGE = 0.05


@dataclass(frozen=True)
class Smoothed:
    """Estimates at the sample instants, shape (rows,) each.

    `surprise` is the squared normalised innovation of the row (about 1 per reading when all is well).
    `unsure` is the standard deviation of the acceleration, by the noise of the readings and their jerk.
    `contradicted` says that the velocity reading is none of the position's motion, and was left out.
    `clock` is the standard deviation of time stamps that are not when the position was read, s; 0 where they
    add less than the steps of the reading do.
    """

    position: Array
    velocity: Array
    acceleration: Array
    surprise: Array
    unsure: Array
    contradicted: bool
    clock: float


def reading_variance(values: Array, first: NDArray[np.bool_]) -> float:
    """Variance of a reading's noise: that of its quantisation, or of its third differences if larger.

    Args:
        values: a reading, shape (rows,); NaN where it cannot be used.
        first: True at the first row of each trial.
    """
    third = np.diff(values, 3)
    inside = ~(first[1:-2] | first[2:-1] | first[3:]) & np.isfinite(third)
    # binomial weights 1, 3, 3, 1: white noise of variance v gives third differences of variance 20 v
    rough = deviation(third[inside]) ** 2 / 20.0
    return max(resolution(values) ** 2 / 12.0, rough, 1e-18)


def smooth(time: Array, position: Array | None, velocity: Array | None, first: NDArray[np.bool_]) -> Smoothed:
    """Smooth what was measured; at least one of position and velocity must be there.

    Args:
        time: s, rising inside a trial, shape (rows,).
        position, velocity: readings, shape (rows,), or None; NaN where a reading cannot be used, which
            the first row of a trial must not be.
        first: True at the first row of each trial.
    """
    rows = len(time)
    zeros = np.zeros(rows)
    readings = np.column_stack([zeros if r is None else r for r in (position, velocity)])
    variances = np.array([0.0 if r is None else reading_variance(r, first) for r in (position, velocity)])
    inside = ~first[1:]
    period = float(np.median(np.diff(time)[inside]))
    passed = kalman.Passed.blank(rows)

    used = np.isfinite(readings) & (variances > 0.0)
    column = 1 if position is None else 0
    series = Series(time, np.where(used, readings, 0.0), used * variances, first)
    steps = np.diff(series.readings[:, column])[inside & used[1:, column] & used[:-1, column]]
    around = ANYWHERE + 2.0 * math.log10(max(float(np.std(steps)) / period, 1e-9))
    untimely, clock = np.zeros((rows, 2)), 0.0
    if position is not None:
        counted = used * np.array([True, False])
        alone = replace(series, variances=counted * variances)
        own, untimely, stamps = of_the_clock(alone, likeliest_jerk(alone, around), period, passed)
        series, alone = (replace(series, variances=one * (variances + untimely)) for one in (used, counted))
        around = NEAR + math.log10(own) if untimely.any() else around
        clock = stamps if np.mean(untimely[:, 0]) > resolution(position) ** 2 / 12.0 else 0.0
    likeliest = likeliest_jerk(series, around)
    surprise = _surprise_when_eager(series, likeliest, passed)
    contradicted = False
    if position is not None and velocity is not None:
        # a position is counted, a velocity was computed by somebody: it is the one that is doubted
        without = _surprise_when_eager(alone, own, passed)
        with_it = surprise, _surprise_when_eager(series, own, passed)
        contradicted = max(map(_too_fast, with_it)) > _too_fast(without) + _CONTRADICTED
        if contradicted:
            used, series, likeliest, surprise = counted, alone, own, without
        else:
            off, spread = _off_position(alone, own, velocity, period, passed)
            noise = _noise_beside(off, spread, variances[1])
            variances[1] = noise or variances[1]
            stray = _stray(velocity, off, variances[1], spread) & ~first
            if noise or stray.any():
                used[stray, 1] = False
                series = replace(series, variances=used * (variances + untimely))
                likeliest = likeliest_jerk(series, around)
                surprise = _surprise_when_eager(series, likeliest, passed)
    for _ in range(_MOST_DOUBTS):
        if _too_fast(surprise) < _DOUBTFUL:
            break
        variances[column] *= _DOUBT
        series = replace(series, variances=used * (variances + untimely))
        surprise = _surprise_when_eager(series, likeliest, passed)
    window = _reach(period, series.usual, likeliest)
    states, jerk, spread = _adapt(series, np.full(rows, likeliest), likeliest, window, passed)
    # rounding alone gives third differences of 1.3 times that variance: more is noise, not a counter
    if position is not None and variances[0] < 2.0 * resolution(position) ** 2 / 12.0:
        series, jerk, row = _with_edges(series, jerk, states[:, 1], resolution(position))
        states, _, spread = _adapt(series, jerk, likeliest, window, kalman.Passed.blank(len(series.time)))
        states, spread = states[row], spread[row]
    if position is not None:
        still = _at_rest(time, states, first, math.sqrt(12.0 * variances[0]))
        states[still, 1:] = 0.0
    estimated = states[:, 0] if position is not None else _relative_position(time, states[:, 1], first)
    return Smoothed(
        np.ascontiguousarray(estimated),
        np.ascontiguousarray(states[:, 1]),
        np.ascontiguousarray(states[:, 2]),
        surprise,
        np.sqrt(spread[:, 1]),
        contradicted,
        clock,
    )


def _off_position(
    alone: Series, likeliest: float, velocity: Array, period: float, passed: kalman.Passed
) -> tuple[Array, Array]:
    """How far a velocity reading is off the velocity of the position alone, and the variance of the latter;
    shape (rows,) both.

    Args:
        alone: the readings, of which only the position is used.
        likeliest: the one intensity of the jerk for it.
        velocity: the reading, shape (rows,); NaN where it cannot be used.
        period: s, of the rows.
        passed: is overwritten.
    """
    window = _reach(period, alone.usual, likeliest)
    states, _, spread = _adapt(alone, np.full(len(velocity), likeliest), likeliest, window, passed)
    return velocity - states[:, 1], spread[:, 0]


def _stray(velocity: Array, off: Array, variance: float, spread: Array) -> NDArray[np.bool_]:
    """Single velocity readings that go away and come back, further than those around them move, while the
    position does not.

    Args:
        velocity: the reading, shape (rows,).
        off, spread: of `_off_position`.
        variance: of the reading's noise.
    """
    earlier, before, after, later = (np.roll(velocity, shift) for shift in (2, 1, -1, -2))
    apart = np.abs(velocity - np.clip(velocity, np.minimum(before, after), np.maximum(before, after)))
    moves = np.abs(before - earlier) + np.abs(later - after)
    alone = apart - moves > math.sqrt(2.0 * TOO_FAST * variance)
    return np.asarray(alone & (off**2 > TOO_FAST * (variance + spread)))


def _noise_beside(off: Array, spread: Array, variance: float) -> float:
    """Variance of a low-passed velocity's noise, from how far it is off the velocity of the position alone;
    0 where it was not low-passed.

    Third differences see noise near the Nyquist frequency only, of which a low-pass leaves none. The median
    leaves the rows aside at which the two differ for another reason. Noise that was low-passed lasts for
    several rows: it weighs as white noise of so many times its variance.

    Args:
        off, spread: of `_off_position`.
        variance: of the noise, as third differences say it.
    """
    size, of_position = deviation(off), float(np.median(spread))
    if size**2 - of_position < _COLOURED * variance:
        return 0.0
    lasts = _lasting(np.clip(np.nan_to_num(off), -3.0 * size, 3.0 * size))
    return max(lasts * size**2 - of_position, 0.0)


def _lasting(noise: Array) -> float:
    """Rows that noise lasts: the sum of its autocorrelation up to where that is no longer positive (Geyer,
    Stat. Sci. 7, 1992)."""
    power = np.abs(np.fft.rfft(noise - noise.mean(), 2 * len(noise))) ** 2
    correlation = np.fft.irfft(power)[: len(noise)]
    ends = np.append(np.flatnonzero(correlation <= 0.0), len(noise))[0]
    return float(2.0 * correlation[:ends].sum() / correlation[0] - 1.0)


def _too_fast(surprise: Array) -> float:
    """Share of the rows that surprise."""
    return float(np.mean(surprise > TOO_FAST))


def _with_edges(
    series: Series, jerk: Array, velocity: Array, count: float
) -> tuple[Series, Array, NDArray[np.intp]]:
    """The series with what a slow counter tells best: the instant at which it counts.

    A counter that stands still over several rows repeats one reading, whose error is the same in all of
    them; together they count as one. Where it then moves on by one count, the axis was at the edge
    between the two, to within the way it goes in one row.

    Returns:
        The series with a row for every edge, the intensity of the jerk on it, and the place of each row
        of the series as it was.
    """
    time, reading, first = series.time, series.readings[:, 0], series.first
    new = first.copy()
    new[1:] |= reading[1:] != reading[:-1]
    starts = np.flatnonzero(new)
    lengths = np.diff(np.append(starts, len(time)))
    repeats = np.repeat(lengths, lengths)
    variances = series.variances.copy()
    variances[:, 0] *= repeats
    jump = np.abs(np.diff(reading, prepend=reading[0]))
    slow = repeats > 1
    slow[1:] |= repeats[:-1] > 1
    read = variances[:, 0] > 0
    read[1:] &= read[:-1]
    edge = np.flatnonzero(new & ~first & slow & read & (np.abs(jump - count) < 0.5 * count))
    way = 0.5 * (velocity[edge] + velocity[edge - 1]) * (time[edge] - time[edge - 1])
    between = np.column_stack([0.5 * (reading[edge] + reading[edge - 1]), np.zeros(len(edge))])
    spread = np.column_stack([way**2 / 12.0 + (_EDGE * count) ** 2, np.zeros(len(edge))])
    longer = Series(
        np.insert(time, edge, 0.5 * (time[edge] + time[edge - 1])),
        np.insert(series.readings, edge, between, axis=0),
        np.insert(variances, edge, spread, axis=0),
        np.insert(first, edge, False),
    )
    row = np.arange(len(time)) + np.cumsum(np.bincount(edge, minlength=len(time)))
    return longer, np.insert(jerk, edge, jerk[edge]), row


def _surprise_when_eager(series: Series, likeliest: float, passed: kalman.Passed) -> Array:
    """Squared normalised innovation of the worse reading under a jerk that follows almost anything."""
    jerk = np.full(len(series.time), _EAGER * likeliest)
    for _ in range(2):
        kalman.forward(series.time, series.readings, series.variances, series.first, jerk, passed)
        surprise = np.where(series.first, 0.0, passed.surprise.max(axis=1))
        jerk = _EAGER * likeliest * _roughness(surprise)
    return surprise


def _reach(period: float, variances: Array, likeliest: float) -> int:
    """Half width in rows of the window over which an intensity is found.

    It follows the time over which a reading is averaged: its noise density against the jerk's.
    """
    times = [
        (variance * period / likeliest) ** (1.0 / order)
        for variance, order in zip(variances, (6.0, 4.0), strict=True)
        if variance > 0
    ]
    reach: float = np.ceil(_WINDOW * min(times) / period)
    return max(int(reach), 3)


def _adapt(
    series: Series, jerk: Array, likeliest: float, reach: int, passed: kalman.Passed
) -> tuple[Array, Array, Array]:
    """Smoothed states, shape (rows, 3), and an intensity of the jerk for every row, from a first guess; the
    variances of velocity and acceleration, shape (rows, 2)."""
    around = _Window(series.first, reach)
    for _ in range(_ROUNDS):
        kalman.forward(series.time, series.readings, series.variances, series.first, jerk, passed)
        _, power, share, _ = kalman.backward(series.time, series.variances, series.first, passed)
        wanted = (around.sum(jerk * power) + _INERTIA) / (around.sum(jerk * share) + _INERTIA)
        jerk = np.clip(jerk * wanted, _QUIETEST * likeliest, _LOUDEST * likeliest)
    kalman.forward(series.time, series.readings, series.variances, series.first, jerk, passed)
    states, _, _, spread = kalman.backward(series.time, series.variances, series.first, passed)
    return states, jerk, spread


class _Window:
    """Sums over the rows within reach of each row, inside its trial."""

    def __init__(self, first: NDArray[np.bool_], reach: int) -> None:
        row = np.arange(len(first))
        start = np.flatnonzero(first)
        lengths = np.diff(np.append(start, len(first)))
        self._low = np.maximum(row - reach, np.repeat(start, lengths))
        self._high = np.minimum(row + reach + 1, np.repeat(start + lengths, lengths))

    def sum(self, values: Array) -> Array:
        """Shape (rows,) in and out."""
        total = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray(total[self._high] - total[self._low])


def _roughness(surprise: Array) -> Array:
    """Factor on the jerk intensity, shape (rows,): large around rows that surprised the first pass."""
    wild = np.flatnonzero(surprise > _SURPRISING)
    rough = np.ones(len(surprise))
    for shift in range(-_REACH, _REACH + 1):
        rows = np.clip(wild + shift, 0, len(surprise) - 1)
        np.maximum.at(rough, rows, np.minimum(surprise[wild] / _SURPRISING, _ROUGHEST) ** 2)
    return rough


def _at_rest(time: Array, states: Array, first: NDArray[np.bool_], grain: float) -> NDArray[np.bool_]:
    """Rows of stretches in which the position hardly moves, against a `grain` of its reading."""
    slow = np.abs(states[:, 1]) < _MOVING * grain
    still = np.zeros(len(time), dtype=bool)
    begins = np.flatnonzero(slow & (first | ~np.concatenate([[False], slow[:-1]])))
    ends = np.flatnonzero(slow & np.concatenate([first[1:] | ~slow[1:], [True]]))
    for begin, end in zip(begins, ends, strict=True):
        clock, position = time[begin : end + 1], states[begin : end + 1, 0]
        if clock[-1] - clock[0] < _REST_S:
            continue
        # a stretch about each row, or the first or last one
        middle = np.clip(clock, clock[0] + 0.5 * _REST_S, clock[-1] - 0.5 * _REST_S)
        before = np.searchsorted(clock, middle - 0.5 * _REST_S)
        after = np.minimum(np.searchsorted(clock, middle + 0.5 * _REST_S), len(clock) - 1)
        still[begin : end + 1] = np.abs(position[after] - position[before]) < grain
    return still


def _relative_position(time: Array, velocity: Array, first: NDArray[np.bool_]) -> Array:
    """Travel since the start of the trial (trapezoidal), where no position was logged."""
    travel = np.zeros(len(time))
    travel[1:] = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    travel[first] = 0.0
    total = np.cumsum(travel)
    start = np.flatnonzero(first)
    lengths = np.diff(np.append(start, len(time)))
    return np.asarray(total - np.repeat(total[start], lengths))
