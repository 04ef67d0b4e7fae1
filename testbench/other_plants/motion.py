"""Integration: what an axis does under its drive, and what torque a known motion asks for.

The compiled functions are cached by this file's date: after a change of `physics.py` remove `__pycache__`.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from testbench.other_plants.physics import (
    _PLAY,
    _QL,
    _R,
    MODES,
    STATES,
    Array,
    Axis,
    Place,
    resistance,
    settle_modes,
    substeps,
)

#: Period of the drive and of the stored motion, s.
TICK = 0.001


class Drive(NamedTuple):
    """A cascade of a position loop (gain 0 for a velocity drive) and a velocity loop, with a torque limit."""

    position_gain: float
    velocity_gain: float
    integral_gain: float
    feedforward: float
    limit: float


@numba.njit(cache=True, error_model="numpy")
def _rates(
    y: Array,
    dy: Array,
    u: float,
    t: float,
    p: Axis,
    lines: Array,
    walk: Array,
    place: Place,
    modes: Array,
) -> None:
    against = resistance(y, dy, y[0], y[1], t, p, lines, walk, place, modes)
    dy[0] = y[1]
    dy[1] = (u * (1.0 - p.saturation * abs(u)) - against) / (p.inertia + p.payload_inertia * place.payload)


@numba.njit(cache=True, error_model="numpy")
def drive_axis(
    p: Axis,
    lines: Array,
    walk: Array,
    place: Place,
    drive: Drive,
    wanted: Array,
    speed: Array,
    noise: Array,
    bristle: float,
    rest: int,
    finer: int,
) -> Array:
    """One trial under its drive (Runge-Kutta of fourth order).

    Args:
        wanted, speed: position and velocity command of each tick.
        noise: torque that the drive adds of itself, of each tick.
        bristle: deflection at the start over the steady one, -1 to 1.
        rest: ticks at the start in which the position is held before time runs.
        finer: divides every step.

    Returns:
        Rows of position, velocity, torque demanded by the current (K i) and acceleration, shape (ticks, 4),
        each at the beginning of its tick.
    """
    y, dy, middle = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    total = np.zeros(STATES)
    modes = np.zeros(MODES)
    y[0], modes[_PLAY] = wanted[0], wanted[0]
    for k in (_QL, _R, _R + 2):
        y[k] = wanted[0]
    if p.law == 2:
        for k in range(4):
            y[2 + k] = bristle * 0.25 * p.coulomb
    else:
        y[2] = bristle * min(p.coulomb, p.static) / p.stiffness
    out = np.empty((len(wanted), 4))
    summed = resistance(y, dy, y[0], 0.0, place.start, p, lines, walk, place, modes)
    for k in range(len(wanted)):
        t = place.start + (k - rest) * TICK
        off = wanted[k] - y[0]
        gain = drive.position_gain
        if k < rest and gain == 0.0:
            gain = 5.0
        error = gain * off + drive.feedforward * speed[k] - y[1]
        u = drive.velocity_gain * error + summed + noise[k]
        if abs(u) < drive.limit:
            summed += drive.integral_gain * error * TICK
        u = min(max(u, -drive.limit), drive.limit)
        out[k, 0], out[k, 1], out[k, 2] = y[0], y[1], u
        parts = finer * substeps(p, y[1], TICK, True)
        h = TICK / parts
        for part in range(parts):
            s = t + part * h
            _rates(y, dy, u, s, p, lines, walk, place, modes)
            if part == 0:
                out[k, 3] = dy[1]
            for j in range(STATES):
                total[j] = dy[j]
                middle[j] = y[j] + 0.5 * h * dy[j]
            _rates(middle, dy, u, s + 0.5 * h, p, lines, walk, place, modes)
            for j in range(STATES):
                total[j] += 2.0 * dy[j]
                middle[j] = y[j] + 0.5 * h * dy[j]
            _rates(middle, dy, u, s + 0.5 * h, p, lines, walk, place, modes)
            for j in range(STATES):
                total[j] += 2.0 * dy[j]
                middle[j] = y[j] + h * dy[j]
            _rates(middle, dy, u, s + h, p, lines, walk, place, modes)
            for j in range(STATES):
                y[j] += h / 6.0 * (total[j] + dy[j])
            settle_modes(y, y[0], y[1], s + h, h, p, walk, place, modes)
    return out


@numba.njit(cache=True, error_model="numpy")
def needed_torque(
    p: Axis, lines: Array, walk: Array, place: Place, motion: Array, bristle: float, rest: int
) -> Array:
    """Torque K i that a known motion asks for (inverse dynamics), of each row of `drive_axis`."""
    y, dy, middle = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    total = np.zeros(STATES)
    modes = np.zeros(MODES)
    modes[_PLAY] = motion[0, 0]
    for k in (_QL, _R, _R + 2):
        y[k] = motion[0, 0]
    if p.law == 2:
        for k in range(4):
            y[2 + k] = bristle * 0.25 * p.coulomb
    else:
        y[2] = bristle * min(p.coulomb, p.static) / p.stiffness
    out = np.empty(len(motion))
    inertia = p.inertia + p.payload_inertia * place.payload
    for k in range(len(motion)):
        t = place.start + (k - rest) * TICK
        q0, w0 = motion[k, 0], motion[k, 1]
        against = resistance(y, dy, q0, w0, t, p, lines, walk, place, modes) + inertia * motion[k, 3]
        kappa = p.saturation
        if kappa > 0.0:
            size = (1.0 - np.sqrt(max(1.0 - 4.0 * kappa * abs(against), 0.0))) / (2.0 * kappa)
            against = np.sign(against) * size
        out[k] = against
        if k + 1 == len(motion):
            break
        q1, w1 = motion[k + 1, 0], motion[k + 1, 1]
        parts = substeps(p, 0.5 * (w0 + w1), TICK, False)
        h = TICK / parts
        for part in range(parts):
            s, e = part / parts, (part + 1) / parts
            m = 0.5 * (s + e)
            qm, wm = q0 + m * (q1 - q0), w0 + m * (w1 - w0)
            qe, we = q0 + e * (q1 - q0), w0 + e * (w1 - w0)
            resistance(y, dy, q0 + s * (q1 - q0), w0 + s * (w1 - w0), t, p, lines, walk, place, modes)
            for j in range(2, STATES):
                total[j] = dy[j]
                middle[j] = y[j] + 0.5 * h * dy[j]
            resistance(middle, dy, qm, wm, t, p, lines, walk, place, modes)
            for j in range(2, STATES):
                total[j] += 2.0 * dy[j]
                middle[j] = y[j] + 0.5 * h * dy[j]
            resistance(middle, dy, qm, wm, t, p, lines, walk, place, modes)
            for j in range(2, STATES):
                total[j] += 2.0 * dy[j]
                middle[j] = y[j] + h * dy[j]
            resistance(middle, dy, qe, we, t, p, lines, walk, place, modes)
            for j in range(2, STATES):
                y[j] += h / 6.0 * (total[j] + dy[j])
            settle_modes(y, qe, we, t + e * TICK, h, p, walk, place, modes)
    return out
