"""Position, velocity and acceleration from noisy, quantised readings: a zero-phase Kalman smoother.

State (q, w, a) driven by white jerk; measured: position, velocity or both. The estimates at the sample
instants lag nothing and work at uneven sample times. How loud the jerk is, is found from the data: first
one intensity for all rows, the likeliest; then for every row its own, so that a steady stretch is averaged
long and a reversal is followed. Where the model of the readings holds, regressors computed from such
estimates bias a regression hardly at all, unlike those from any one filter. Innovations beyond a few
standard deviations mark rows where the axis moved faster than the sampling shows.

Source: Rauch, Tung & Striebel, AIAA J. 3(8), 1965; Durbin & Koopman, Time Series Analysis by State
Space Methods, 2nd ed. 2012; the local intensities are MacKay's fixed point (Neural Comput. 4, 1992).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from idtool import kalman
from idtool.model.motion import Array

#: Squared normalised innovations count at most this much in the likelihood, so that a few steps in
#: the motion do not make all of it look rough.
_ROBUST = 9.0
#: The readings are judged under a jerk louder than likeliest by this factor, and much louder around rows
#: with more than this surprise (they and so many neighbours, up to this factor squared): what is still
#: surprising then, is no matter of smoothing.
_EAGER = 10.0
_SURPRISING = 9.0
_REACH = 3
_ROUGHEST = 100.0
#: Squared normalised innovation above which the motion was faster than its sampling.
TOO_FAST = 25.0
#: If more rows than this are, it is not the motion: a reading is worse than its steps suggest (a drive's
#: own filter delays its velocity, say). Its variance is raised by this factor, so many times at most.
_DOUBTFUL = 0.03
_DOUBT = 10.0
_VELOCITY_DOUBTS = 7
_MOST_DOUBTS = 10
#: Local intensities: rounds of the fixed point, half width of the window in smoothing times, what counts
#: as one more piece of evidence for leaving the intensity as it is, and the range about the global one.
_ROUNDS = 7
_WINDOW = 8.0
_INERTIA = 1.0
_QUIETEST = 1e-4
_LOUDEST = 1e6


@dataclass(frozen=True)
class Smoothed:
    """Estimates at the sample instants, shape (rows,) each.

    `surprise` is the squared normalised innovation of the row (about 1 per reading when all is well).
    """

    position: Array
    velocity: Array
    acceleration: Array
    surprise: Array


def reading_variance(values: Array, first: NDArray[np.bool_]) -> float:
    """Variance of a reading's noise: that of its quantisation, or of its third differences if larger.

    Args:
        values: a reading, shape (rows,).
        first: True at the first row of each trial.
    """
    steps = np.abs(np.diff(values))
    steps = steps[steps > 1e-12 * (1.0 + np.max(np.abs(values)))]
    resolution = float(np.quantile(steps, 0.01)) if len(steps) else 0.0
    third = np.diff(values, 3)
    inside = ~(first[1:-2] | first[2:-1] | first[3:])
    spread = third[inside]
    # binomial weights 1, 3, 3, 1: white noise of variance v gives third differences of variance 20 v
    rough = (1.4826 * float(np.median(np.abs(spread)))) ** 2 / 20.0 if len(spread) else 0.0
    return max(resolution**2 / 12.0, rough, 1e-18)


def smooth(time: Array, position: Array | None, velocity: Array | None, first: NDArray[np.bool_]) -> Smoothed:
    """Smooth what was measured; at least one of position and velocity must be there.

    Args:
        time: s, rising inside a trial, shape (rows,).
        position, velocity: readings, shape (rows,), or None.
        first: True at the first row of each trial.
    """
    rows = len(time)
    zeros = np.zeros(rows)
    readings = np.column_stack([zeros if r is None else r for r in (position, velocity)])
    q_variance = 0.0 if position is None else reading_variance(position, first)
    w_variance = 0.0 if velocity is None else reading_variance(velocity, first)
    inside = ~first[1:]
    period = float(np.median(np.diff(time)[inside]))
    passed = kalman.Passed.blank(rows)

    def cost(log_jerk: float) -> float:
        jerk = np.full(rows, 10.0**log_jerk)
        kalman.forward(time, readings, (q_variance, w_variance), first, jerk, passed)
        likely = np.minimum(passed.surprise, _ROBUST) + np.log(passed.variance)
        return float(likely[~first].sum())

    steps = np.diff(readings[:, 1] if position is None else readings[:, 0])[inside]
    centre = 2.0 * math.log10(max(float(np.std(steps)) / period, 1e-9))
    result = optimize.minimize_scalar(
        cost, bounds=(centre - 5.0, centre + 9.0), method="bounded", options={"xatol": 0.1}
    )
    likeliest = 10.0 ** float(result.x)
    for doubts in range(_MOST_DOUBTS):
        surprise = _surprise_when_eager(time, readings, (q_variance, w_variance), first, likeliest, passed)
        if np.mean(surprise > TOO_FAST) < _DOUBTFUL:
            break
        # a position is counted, a velocity was computed by somebody: the velocity is doubted first
        if velocity is not None and (position is None or doubts < _VELOCITY_DOUBTS):
            w_variance *= _DOUBT
        else:
            q_variance *= _DOUBT
    states = _adapt(time, readings, (q_variance, w_variance), first, likeliest, passed)
    estimated = states[:, 0] if position is not None else _relative_position(time, states[:, 1], first)
    return Smoothed(
        np.ascontiguousarray(estimated),
        np.ascontiguousarray(states[:, 1]),
        np.ascontiguousarray(states[:, 2]),
        surprise,
    )


def _surprise_when_eager(
    time: Array,
    readings: Array,
    variances: tuple[float, float],
    first: NDArray[np.bool_],
    likeliest: float,
    passed: kalman.Passed,
) -> Array:
    """Squared normalised innovation of the worse reading under a jerk that follows almost anything."""
    jerk = np.full(len(time), _EAGER * likeliest)
    for _ in range(2):
        kalman.forward(time, readings, variances, first, jerk, passed)
        surprise = np.where(first, 0.0, passed.surprise.max(axis=1))
        jerk = _EAGER * likeliest * _roughness(surprise)
    return surprise


def _adapt(
    time: Array,
    readings: Array,
    variances: tuple[float, float],
    first: NDArray[np.bool_],
    likeliest: float,
    passed: kalman.Passed,
) -> Array:
    """Smoothed states, shape (rows, 3), with an intensity of the jerk of its own at every row."""
    rows = len(time)
    period = float(np.median(np.diff(time)[~first[1:]]))
    # the time over which a reading is averaged: its noise density against the jerk's
    times = [
        (variance * period / likeliest) ** (1.0 / order)
        for variance, order in zip(variances, (6.0, 4.0), strict=True)
        if variance > 0
    ]
    reach = max(math.ceil(_WINDOW * min(times) / period), 3)
    around = _Window(first, reach)
    jerk = np.full(rows, likeliest)
    for _ in range(_ROUNDS):
        kalman.forward(time, readings, variances, first, jerk, passed)
        _, power, share = kalman.backward(time, variances, first, passed)
        wanted = (around.sum(jerk * power) + _INERTIA) / (around.sum(jerk * share) + _INERTIA)
        jerk = np.clip(jerk * wanted, _QUIETEST * likeliest, _LOUDEST * likeliest)
    kalman.forward(time, readings, variances, first, jerk, passed)
    return kalman.backward(time, variances, first, passed)[0]


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


def _relative_position(time: Array, velocity: Array, first: NDArray[np.bool_]) -> Array:
    """Travel since the start of the trial (trapezoidal), where no position was logged."""
    travel = np.zeros(len(time))
    travel[1:] = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    travel[first] = 0.0
    total = np.cumsum(travel)
    start = np.flatnonzero(first)
    lengths = np.diff(np.append(start, len(time)))
    return np.asarray(total - np.repeat(total[start], lengths))
