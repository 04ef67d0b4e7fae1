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
from idtool.sensor_faults import resolution as smallest_step

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


@numba.njit(cache=True)
def _filter(  # type: ignore[no-untyped-def]
    time, position, velocity, first, jerk, rough, position_variance, velocity_variance, robust, keep
):
    """Forward pass; with `keep` it stores what the backward pass needs.

    A variance <= 0 means that the reading is not used, NaN that it is not used at that row.
    """
    n = time.shape[0]
    rows = n if keep else 1
    means = np.empty((rows, 3))
    covs = np.empty((rows, 3, 3))
    predicted_means = np.empty((rows, 3))
    predicted_covs = np.empty((rows, 3, 3))
    surprise = np.zeros((2, n))
    cost = 0.0
    m = np.zeros(3)
    P = np.zeros((3, 3))
    mp = np.zeros(3)
    Pp = np.zeros((3, 3))
    F = np.eye(3)
    for k in range(n):
        if first[k]:
            h = 0.0
            mp[0] = position[k] if position_variance > 0 else 0.0
            mp[1] = velocity[k] if velocity_variance > 0 else 0.0
            mp[2] = 0.0
            Pp[:, :] = 0.0
            Pp[0, 0] = 9.0 * position_variance if position_variance > 0 else 1e-12
            Pp[1, 1] = 9.0 * velocity_variance if velocity_variance > 0 else 1.0
            Pp[2, 2] = max(jerk * rough[k], 1e-6)
        else:
            h = time[k] - time[k - 1]
            s2 = jerk * rough[k]
            F[0, 1] = h
            F[1, 2] = h
            F[0, 2] = 0.5 * h * h
            mp[0] = m[0] + h * m[1] + 0.5 * h * h * m[2]
            mp[1] = m[1] + h * m[2]
            mp[2] = m[2]
            Pp[:, :] = F @ P @ F.T
            h2 = h * h
            Pp[0, 0] += s2 * h2 * h2 * h / 20.0
            Pp[0, 1] += s2 * h2 * h2 / 8.0
            Pp[0, 2] += s2 * h2 * h / 6.0
            Pp[1, 1] += s2 * h2 * h / 3.0
            Pp[1, 2] += s2 * h2 / 2.0
            Pp[2, 2] += s2 * h
            Pp[1, 0] = Pp[0, 1]
            Pp[2, 0] = Pp[0, 2]
            Pp[2, 1] = Pp[1, 2]
        if keep:
            predicted_means[k] = mp
            predicted_covs[k] = Pp
        m[:] = mp
        P[:, :] = Pp
        for reading in range(2):
            variance = position_variance if reading == 0 else velocity_variance
            measured = position[k] if reading == 0 else velocity[k]
            if variance <= 0 or math.isnan(measured):
                continue
            s = P[reading, reading] + variance
            e = measured - m[reading]
            nis = e * e / s
            if not first[k]:
                surprise[reading, k] = nis
                cost += math.log(s) + min(nis, robust)
            g0 = P[0, reading] / s
            g1 = P[1, reading] / s
            g2 = P[2, reading] / s
            row0 = P[reading, 0]
            row1 = P[reading, 1]
            row2 = P[reading, 2]
            m[0] += g0 * e
            m[1] += g1 * e
            m[2] += g2 * e
            P[0, 0] -= g0 * row0
            P[0, 1] -= g0 * row1
            P[0, 2] -= g0 * row2
            P[1, 0] -= g1 * row0
            P[1, 1] -= g1 * row1
            P[1, 2] -= g1 * row2
            P[2, 0] -= g2 * row0
            P[2, 1] -= g2 * row1
            P[2, 2] -= g2 * row2
        if keep:
            means[k] = m
            covs[k] = P
    return cost, surprise, means, covs, predicted_means, predicted_covs


@numba.njit(cache=True)
def _smooth(time, first, means, covs, predicted_means, predicted_covs):  # type: ignore[no-untyped-def]
    n = time.shape[0]
    out = means.copy()
    F = np.eye(3)
    for k in range(n - 2, -1, -1):
        if first[k + 1]:
            continue
        h = time[k + 1] - time[k]
        F[0, 1] = h
        F[1, 2] = h
        F[0, 2] = 0.5 * h * h
        # gain G = P F' Pp^-1, through the transposed system
        G = np.linalg.solve(predicted_covs[k + 1], F @ covs[k]).T
        out[k] = means[k] + G @ (out[k + 1] - predicted_means[k + 1])
    return out


def reading_variance(values: Array, first: NDArray[np.bool_]) -> float:
    """Variance of a reading's noise: that of its quantisation, or of its third differences if larger.

    Args:
        values: a reading, shape (rows,); NaN where it cannot be used.
        first: True at the first row of each trial.
    """
    resolution = smallest_step(values)
    third = np.diff(values, 3)
    inside = ~(first[1:-2] | first[2:-1] | first[3:]) & np.isfinite(third)
    spread = third[inside]
    # binomial weights 1, 3, 3, 1: white noise of variance v gives third differences of variance 20 v
    rough = (1.4826 * float(np.median(np.abs(spread)))) ** 2 / 20.0 if len(spread) else 0.0
    return max(resolution**2 / 12.0, rough, 1e-18)


def smooth(time: Array, position: Array | None, velocity: Array | None, first: NDArray[np.bool_]) -> Smoothed:
    """Smooth what was measured; at least one of position and velocity must be there.

    Args:
        time: s, rising inside a trial, shape (rows,).
        position, velocity: readings, shape (rows,), or None; NaN where a reading cannot be used, which
            the first row of a trial must not be.
        first: True at the first row of each trial.
    """
    zeros = np.zeros(len(time))
    q = zeros if position is None else position
    w = zeros if velocity is None else velocity
    q_variance = 0.0 if position is None else reading_variance(position, first)
    w_variance = 0.0 if velocity is None else reading_variance(velocity, first)
    speed = np.diff(w) if position is None else np.diff(q)
    inside = ~first[1:]
    scale = float(np.std(speed[inside & np.isfinite(speed)])) / float(np.median(np.diff(time)[inside]))
    scale = max(scale, 1e-9)

    even = np.ones(len(time))

    def cost(log_jerk: float) -> float:
        value = _filter(time, q, w, first, 10.0**log_jerk, even, q_variance, w_variance, _ROBUST, False)[0]
        return float(value)

    centre = 2.0 * math.log10(scale)
    result = optimize.minimize_scalar(
        cost, bounds=(centre - 5.0, centre + 9.0), method="bounded", options={"xatol": 0.1}
    )
    jerk = _EAGER * 10.0 ** float(result.x)
    for doubts in range(_MOST_DOUBTS):
        surprise = _filter(time, q, w, first, jerk, even, q_variance, w_variance, _ROBUST, False)[1]
        rough = _roughness(surprise.max(axis=0))
        surprise = _filter(time, q, w, first, jerk, rough, q_variance, w_variance, _ROBUST, False)[1]
        if np.mean(surprise.max(axis=0) > TOO_FAST) < _DOUBTFUL:
            break
        # a position is counted, a velocity was computed by somebody: the velocity is doubted first
        if velocity is not None and (position is None or doubts < _VELOCITY_DOUBTS):
            w_variance *= _DOUBT
        else:
            q_variance *= _DOUBT
    passed = _filter(time, q, w, first, jerk, rough, q_variance, w_variance, _ROBUST, True)
    _, surprise, means, covs, predicted_means, predicted_covs = passed
    states = _smooth(time, first, means, covs, predicted_means, predicted_covs)
    estimated = states[:, 0] if position is not None else _relative_position(time, states[:, 1], first)
    return Smoothed(
        np.ascontiguousarray(estimated),
        np.ascontiguousarray(states[:, 1]),
        np.ascontiguousarray(states[:, 2]),
        surprise.max(axis=0),
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
