"""Compiled Kalman filter and disturbance smoother for motion driven by white jerk.

State (q, w, a); over a step h the jerk's intensity s adds the covariance s Q(h). Readings of position
and velocity come one after the other at each row. The backward pass is the disturbance smoother: it
carries the score r of the readings ahead and its information N, which give both the smoothed state and,
for every step, by how much the data want its jerk louder or quieter.

Source: de Jong, Biometrika 76, 1989; Durbin & Koopman, Time Series Analysis by State Space Methods,
2nd ed. 2012, sections 4.5 and 6.4 (readings one at a time).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.model.jit import jit
from idtool.model.motion import Array

#: A state, and the upper triangle of its covariance by rows.
_State = tuple[float, float, float]
_Triangle = tuple[float, float, float, float, float, float]


@dataclass(frozen=True)
class Passed:
    """What the forward pass leaves; column 0 belongs to the position, 1 to the velocity.

    Attributes:
        mean: predicted state, shape (rows, 3).
        covariance: its upper triangle by rows, shape (rows, 6).
        innovation, variance: of each reading, shape (rows, 2); 0 and 1 where it is not used.
        gain: Kalman gain of each reading, shape (rows, 2, 3).
    """

    mean: Array
    covariance: Array
    innovation: Array
    variance: Array
    gain: Array

    @classmethod
    def blank(cls, rows: int) -> Passed:
        """Room for a pass; one object serves many."""
        return cls(
            np.empty((rows, 3)),
            np.empty((rows, 6)),
            np.empty((rows, 2)),
            np.empty((rows, 2)),
            np.empty((rows, 2, 3)),
        )

    @property
    def surprise(self) -> Array:
        """Squared normalised innovations, shape (rows, 2)."""
        return np.asarray(self.innovation**2 / self.variance)


def forward(
    time: Array,
    readings: Array,
    variances: Array,
    first: NDArray[np.bool_],
    jerk: Array,
    passed: Passed,
) -> None:
    """Filter the readings into `passed`.

    Args:
        time: s, rising inside a trial, shape (rows,).
        readings: position and velocity, shape (rows, 2).
        variances: of the readings, shape (rows, 2); 0 is a reading that is not used.
        first: True at the first row of each trial, shape (rows,).
        jerk: intensity of the jerk over the step that ends at each row, shape (rows,).
        passed: is overwritten.
    """
    p = passed
    kept = p.mean, p.covariance, p.innovation, p.variance, p.gain
    _forward(time, readings, variances, first, jerk, *kept, math.inf)


def unlikely(
    time: Array, readings: Array, variances: Array, first: NDArray[np.bool_], jerk: Array, most: float
) -> float:
    """Minus twice the logarithm of the likelihood of the readings, first rows of trials aside, up to a
    constant; a squared normalised innovation counts at most as `most`. Arguments as of `forward`."""
    p = Passed.blank(0)
    kept = p.mean, p.covariance, p.innovation, p.variance, p.gain
    return float(_forward(time, readings, variances, first, jerk, *kept, most))


def backward(
    time: Array, variances: Array, first: NDArray[np.bool_], passed: Passed
) -> tuple[Array, Array, Array, Array]:
    """Smooth.

    Returns:
        Smoothed states, shape (rows, 3); of each step r'Qr and tr(QN), shape (rows,): the jerk's
        likelihood rises with its intensity where the first exceeds the second; and the variances of
        the smoothed velocity and acceleration, shape (rows, 2).
    """
    p = passed
    rows = len(time)
    state, power, share, spread = np.empty((rows, 3)), np.empty(rows), np.empty(rows), np.empty((rows, 2))
    _backward(
        time,
        variances,
        first,
        p.mean,
        p.covariance,
        p.innovation,
        p.variance,
        p.gain,
        state,
        power,
        share,
        spread,
    )
    return state, power, share, spread


@jit()
def _over_step(m: _State, P: _Triangle, h: float, jerk: float) -> tuple[_State, _Triangle]:
    h2 = h * h
    half = 0.5 * h2
    # F P F' through its rows b = F P
    p00, p01, p02, p11, p12, p22 = P
    b00 = p00 + h * p01 + half * p02
    b01 = p01 + h * p11 + half * p12
    b02 = p02 + h * p12 + half * p22
    b11 = p11 + h * p12
    b12 = p12 + h * p22
    return (m[0] + (h * m[1] + half * m[2]), m[1] + h * m[2], m[2]), (
        b00 + h * b01 + half * b02 + jerk * h2 * h2 * h / 20.0,
        b01 + h * b02 + jerk * h2 * h2 / 8.0,
        b02 + jerk * h2 * h / 6.0,
        b11 + h * b12 + jerk * h2 * h / 3.0,
        b12 + jerk * h2 / 2.0,
        p22 + jerk * h,
    )


@jit()
def _through(
    m: _State, P: _Triangle, row: _State, error: float, variance: float
) -> tuple[_State, _Triangle, _State]:
    """State and covariance after a reading, and its gain; `row` is the covariance with what it reads."""
    r0, r1, r2 = row
    g0, g1, g2 = r0 / variance, r1 / variance, r2 / variance
    p00, p01, p02, p11, p12, p22 = P
    return (
        (m[0] + g0 * error, m[1] + g1 * error, m[2] + g2 * error),
        (p00 - g0 * r0, p01 - g0 * r1, p02 - g0 * r2, p11 - g1 * r1, p12 - g1 * r2, p22 - g2 * r2),
        (g0, g1, g2),
    )


@jit()
def _forward(
    time: Array,
    readings: Array,
    variances: Array,
    first: NDArray[np.bool_],
    jerk: Array,
    mean: Array,
    covariance: Array,
    innovation: Array,
    variance: Array,
    gain: Array,
    most: float,
) -> float:
    """Without room for the rows nothing is kept of them, and the sum of `unlikely` comes back."""
    keep = len(mean) > 0
    m = (0.0, 0.0, 0.0)
    P = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    unlikely, product = 0.0, 1.0  # a logarithm of many variances at once
    for k in range(time.shape[0]):
        noise = variances[k, 0], variances[k, 1]
        if first[k]:
            read = noise[0] > 0.0, noise[1] > 0.0
            m = (readings[k, 0] if read[0] else 0.0, readings[k, 1] if read[1] else 0.0, 0.0)
            q_variance, w_variance = 9.0 * noise[0] if read[0] else 1e-12, 9.0 * noise[1]
            if not read[1]:  # as fast as the first two positions say, or faster than a robot
                w_variance = 1.0
                if read[0] and k + 1 < time.shape[0] and not first[k + 1] and time[k + 1] > time[k]:
                    w_variance += ((readings[k + 1, 0] - readings[k, 0]) / (time[k + 1] - time[k])) ** 2
            P = (q_variance, 0.0, 0.0, w_variance, 0.0, max(jerk[k], 1e-6))
        else:
            m, P = _over_step(m, P, time[k] - time[k - 1], jerk[k])
        if keep:
            mean[k, 0], mean[k, 1], mean[k, 2] = m
            for i in range(6):
                covariance[k, i] = P[i]
        for j in range(2):
            e, s = 0.0, 1.0
            if noise[j] > 0.0:
                row = (P[0], P[1], P[2]) if j == 0 else (P[1], P[3], P[4])
                e, s = readings[k, j] - m[j], row[j] + noise[j]
                m, P, g = _through(m, P, row, e, s)
                if keep:
                    gain[k, j, 0], gain[k, j, 1], gain[k, j, 2] = g
            if keep:
                innovation[k, j], variance[k, j] = e, s
            elif not first[k]:
                unlikely += min(e * e / s, most)
                product *= s
                if not 1e-100 < product < 1e100:
                    unlikely += math.log(product)
                    product = 1.0
    return unlikely + math.log(product)


@jit()
def _by_readings_ahead(N: Array, c0: float, c1: float, c2: float) -> float:
    """c'Nc: what the readings ahead take off the variance of a part of the state of which c is the row."""
    across = N[0, 1] * c0 * c1 + N[0, 2] * c0 * c2 + N[1, 2] * c1 * c2
    return float(N[0, 0] * c0 * c0 + N[1, 1] * c1 * c1 + N[2, 2] * c2 * c2 + 2.0 * across)


@jit()
def _backward(
    time: Array,
    variances: Array,
    first: NDArray[np.bool_],
    mean: Array,
    covariance: Array,
    innovation: Array,
    variance: Array,
    gain: Array,
    state: Array,
    power: Array,
    share: Array,
    spread: Array,
) -> None:
    r = np.zeros(3)
    N = np.zeros((3, 3))
    Ng = np.zeros(3)
    for k in range(time.shape[0] - 1, -1, -1):
        for j in range(1, -1, -1):
            if variances[k, j] <= 0:
                continue
            # through reading j: r <- H'e/s + (I - gH)'r, N <- H'H/s + (I - gH)'N(I - gH)
            g = gain[k, j]
            s = variance[k, j]
            r[j] += innovation[k, j] / s - (g[0] * r[0] + g[1] * r[1] + g[2] * r[2])
            for i in range(3):
                Ng[i] = N[i, 0] * g[0] + N[i, 1] * g[1] + N[i, 2] * g[2]
            N[j, j] += 1.0 / s - 2.0 * Ng[j] + g[0] * Ng[0] + g[1] * Ng[1] + g[2] * Ng[2]
            for i in range(3):
                if i != j:
                    N[i, j] -= Ng[i]
                    N[j, i] = N[i, j]
        c = covariance[k]
        state[k, 0] = mean[k, 0] + c[0] * r[0] + c[1] * r[1] + c[2] * r[2]
        state[k, 1] = mean[k, 1] + c[1] * r[0] + c[3] * r[1] + c[4] * r[2]
        state[k, 2] = mean[k, 2] + c[2] * r[0] + c[4] * r[1] + c[5] * r[2]
        spread[k, 0] = c[3] - _by_readings_ahead(N, c[1], c[3], c[4])
        spread[k, 1] = c[5] - _by_readings_ahead(N, c[2], c[4], c[5])
        if first[k]:
            power[k] = 0.0
            share[k] = 0.0
            r[:] = 0.0
            N[:, :] = 0.0
            continue
        h = time[k] - time[k - 1]
        h2 = h * h
        q00, q01, q02 = h2 * h2 * h / 20.0, h2 * h2 / 8.0, h2 * h / 6.0
        q11, q12, q22 = h2 * h / 3.0, h2 / 2.0, h
        cross = q01 * r[0] * r[1] + q02 * r[0] * r[2] + q12 * r[1] * r[2]
        power[k] = q00 * r[0] * r[0] + q11 * r[1] * r[1] + q22 * r[2] * r[2] + 2.0 * cross
        cross = q01 * N[0, 1] + q02 * N[0, 2] + q12 * N[1, 2]
        share[k] = q00 * N[0, 0] + q11 * N[1, 1] + q22 * N[2, 2] + 2.0 * cross
        # through the step: r <- F'r, N <- F'NF by its columns b = NF
        half = 0.5 * h2
        r[2] += half * r[0] + h * r[1]
        r[1] += h * r[0]
        b01 = h * N[0, 0] + N[0, 1]
        b02 = half * N[0, 0] + h * N[0, 1] + N[0, 2]
        b11 = h * N[0, 1] + N[1, 1]
        b12 = half * N[0, 1] + h * N[1, 1] + N[1, 2]
        b22 = half * N[0, 2] + h * N[1, 2] + N[2, 2]
        N[0, 1] = b01
        N[0, 2] = b02
        N[1, 1] = h * b01 + b11
        N[1, 2] = h * b02 + b12
        N[2, 2] = half * b02 + h * b12 + b22
        N[1, 0] = b01
        N[2, 0] = b02
        N[2, 1] = N[1, 2]
