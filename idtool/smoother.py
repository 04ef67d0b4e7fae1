"""Position, velocity and acceleration from noisy, quantised readings: a zero-phase Kalman smoother.

State (q, w, a) driven by white jerk of intensity s; measured: position, velocity or both. A forward
Kalman filter and a backward Rauch-Tung-Striebel pass give estimates at the sample instants that lag
nothing and work at uneven sample times. The intensity is the one under which the innovations are
most likely, so the smoothing follows the data: a fast axis is smoothed less. Innovations beyond a few
standard deviations mark rows where the axis moved faster than the sampling shows.

Source: Rauch, Tung & Striebel, AIAA J. 3(8), 1965; Saerkkae, Bayesian Filtering and Smoothing, 2013.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import optimize

from idtool.model.motion import Array

#: Squared normalised innovations count at most this much in the likelihood, so that a few steps in
#: the motion do not make all of it look rough.
_ROBUST = 9.0
#: Rows with more than this let the axis jerk harder, they and this many neighbours, up to this factor
#: (squared): a step in the motion is followed, the rest stays smooth.
_SURPRISING = 9.0
_REACH = 3
_ROUGHEST = 100.0
#: Smooth less than is likeliest by this much: the low-pass of the fit comes after, and what the smoother
#: takes away no filter brings back (it looks like inertia and bristle damping).
_EAGER = 10.0
#: Squared normalised innovation above which the motion was faster than its sampling.
TOO_FAST = 25.0
#: If more rows than this are, it is not the motion: a reading is worse than its steps suggest (a drive's
#: own filter delays its velocity, say). Its variance is raised by this factor, so many times at most.
_DOUBTFUL = 0.03
_DOUBT = 10.0
_VELOCITY_DOUBTS = 7
_MOST_DOUBTS = 10


@dataclass(frozen=True)
class Smoothed:
    """Estimates at the sample instants, shape (rows,) each.

    `surprise` is the squared normalised innovation of the row (about 1 per reading when all is well).
    """

    position: Array
    velocity: Array
    acceleration: Array
    surprise: Array


@numba.njit(cache=True, inline="always")
def _carried(P00, P01, P02, P11, P12, P22, h, s2):  # type: ignore[no-untyped-def]
    """Covariance after a step h of white jerk: F P F' + Q, its upper triangle.

    Written out because the matrices are so small that calling a matrix product costs more than it.
    """
    half = 0.5 * h * h
    A00 = P00 + h * P01 + half * P02
    A01 = P01 + h * P11 + half * P12
    A02 = P02 + h * P12 + half * P22
    A11 = P11 + h * P12
    A12 = P12 + h * P22
    h2 = h * h
    return (
        A00 + h * A01 + half * A02 + s2 * h2 * h2 * h / 20.0,
        A01 + h * A02 + s2 * h2 * h2 / 8.0,
        A02 + s2 * h2 * h / 6.0,
        A11 + h * A12 + s2 * h2 * h / 3.0,
        A12 + s2 * h2 / 2.0,
        P22 + s2 * h,
    )


@numba.njit(cache=True)
def _filter(  # type: ignore[no-untyped-def]
    time, position, velocity, first, jerk, rough, position_variance, velocity_variance, robust, keep, surprise
):
    """Forward pass; with `keep` it stores what the backward pass needs: means, (rows, 3), and upper
    triangles of the covariances, (rows, 6).

    A variance <= 0 means that the reading is not used. `surprise`, (rows,), is filled with the squared
    normalised innovation of each row, the larger one of its readings.
    """
    n = time.shape[0]
    rows = n if keep else 1
    means = np.empty((rows, 3))
    covs = np.empty((rows, 6))
    cost = 0.0
    q = w = a = 0.0
    P00 = P01 = P02 = P11 = P12 = P22 = 0.0
    for k in range(n):
        if first[k]:
            q = position[k] if position_variance > 0 else 0.0
            w = velocity[k] if velocity_variance > 0 else 0.0
            a = 0.0
            P01 = P02 = P12 = 0.0
            P00 = 9.0 * position_variance if position_variance > 0 else 1e-12
            P11 = 9.0 * velocity_variance if velocity_variance > 0 else 1.0
            P22 = max(jerk * rough[k], 1e-6)
        else:
            h = time[k] - time[k - 1]
            q = q + h * w + 0.5 * h * h * a
            w = w + h * a
            P00, P01, P02, P11, P12, P22 = _carried(P00, P01, P02, P11, P12, P22, h, jerk * rough[k])
        surprise[k] = 0.0
        if position_variance > 0:
            s = P00 + position_variance
            e = position[k] - q
            if not first[k]:
                nis = e * e / s
                surprise[k] = nis
                cost += math.log(s) + min(nis, robust)
            g0, g1, g2 = P00 / s, P01 / s, P02 / s
            q += g0 * e
            w += g1 * e
            a += g2 * e
            P11 -= g1 * P01
            P12 -= g1 * P02
            P22 -= g2 * P02
            P00 -= g0 * P00
            P01 -= g0 * P01
            P02 -= g0 * P02
        if velocity_variance > 0:
            s = P11 + velocity_variance
            e = velocity[k] - w
            if not first[k]:
                nis = e * e / s
                surprise[k] = max(surprise[k], nis)
                cost += math.log(s) + min(nis, robust)
            g0, g1, g2 = P01 / s, P11 / s, P12 / s
            q += g0 * e
            w += g1 * e
            a += g2 * e
            P00 -= g0 * P01
            P02 -= g0 * P12
            P22 -= g2 * P12
            P01 -= g0 * P11
            P12 -= g1 * P12
            P11 -= g1 * P11
        if keep:
            means[k, 0], means[k, 1], means[k, 2] = q, w, a
            covs[k, 0], covs[k, 1], covs[k, 2] = P00, P01, P02
            covs[k, 3], covs[k, 4], covs[k, 5] = P11, P12, P22
    return cost, means, covs


@numba.njit(cache=True)
def _smooth(time, first, jerk, rough, means, covs):  # type: ignore[no-untyped-def]
    """Backward pass. The smoothed states replace `means`, so that a long log needs no second copy; what
    the forward pass predicted is computed again for the same reason."""
    for k in range(time.shape[0] - 2, -1, -1):
        if first[k + 1]:
            continue
        h = time[k + 1] - time[k]
        half = 0.5 * h * h
        P00, P01, P02 = covs[k, 0], covs[k, 1], covs[k, 2]
        P11, P12, P22 = covs[k, 3], covs[k, 4], covs[k, 5]
        q, w, a = means[k, 0], means[k, 1], means[k, 2]
        # the gain is P F' Pp^-1; Pp^-1 times the news, by the factors L D L' of Pp
        d0, u01, u02, u11, u12, u22 = _carried(P00, P01, P02, P11, P12, P22, h, jerk * rough[k + 1])
        l10, l20 = u01 / d0, u02 / d0
        d1 = u11 - l10 * u01
        c12 = u12 - l10 * u02
        l21 = c12 / d1
        d2 = u22 - l20 * u02 - l21 * c12
        y0 = means[k + 1, 0] - (q + h * w + half * a)
        y1 = means[k + 1, 1] - (w + h * a) - l10 * y0
        y2 = means[k + 1, 2] - a - l20 * y0 - l21 * y1
        x2 = y2 / d2
        x1 = y1 / d1 - l21 * x2
        x0 = y0 / d0 - l10 * x1 - l20 * x2
        # F' x, then P
        x2 += half * x0 + h * x1
        x1 += h * x0
        means[k, 0] = q + P00 * x0 + P01 * x1 + P02 * x2
        means[k, 1] = w + P01 * x0 + P11 * x1 + P12 * x2
        means[k, 2] = a + P02 * x0 + P12 * x1 + P22 * x2


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
    zeros = np.zeros(len(time))
    q = zeros if position is None else position
    w = zeros if velocity is None else velocity
    q_variance = 0.0 if position is None else reading_variance(position, first)
    w_variance = 0.0 if velocity is None else reading_variance(velocity, first)
    speed = np.diff(w) if position is None else np.diff(q)
    scale = float(np.std(speed[~first[1:]])) / float(np.median(np.diff(time)[~first[1:]]))
    scale = max(scale, 1e-9)

    even = np.ones(len(time))
    surprise = np.empty(len(time))  # one for all passes: a long log's would cost more to get than to fill

    def forward(jerk: float, rough: Array, *, keep: bool = False) -> tuple[float, Array, Array]:
        passed: tuple[float, Array, Array] = _filter(
            time, q, w, first, jerk, rough, q_variance, w_variance, _ROBUST, keep, surprise
        )
        return passed

    def cost(log_jerk: float) -> float:
        return float(forward(10.0**log_jerk, even)[0])

    centre = 2.0 * math.log10(scale)
    result = optimize.minimize_scalar(
        cost, bounds=(centre - 5.0, centre + 9.0), method="bounded", options={"xatol": 0.1}
    )
    jerk = _EAGER * 10.0 ** float(result.x)
    for doubts in range(_MOST_DOUBTS):
        forward(jerk, even)
        rough = _roughness(surprise)
        forward(jerk, rough)
        if np.mean(surprise > TOO_FAST) < _DOUBTFUL:
            break
        # a position is counted, a velocity was computed by somebody: the velocity is doubted first
        if velocity is not None and (position is None or doubts < _VELOCITY_DOUBTS):
            w_variance *= _DOUBT
        else:
            q_variance *= _DOUBT
    _, states, covs = forward(jerk, rough, keep=True)
    _smooth(time, first, jerk, rough, states, covs)
    del covs
    estimated = states[:, 0] if position is not None else _relative_position(time, states[:, 1], first)
    return Smoothed(
        np.ascontiguousarray(estimated),
        np.ascontiguousarray(states[:, 1]),
        np.ascontiguousarray(states[:, 2]),
        surprise,
    )


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
