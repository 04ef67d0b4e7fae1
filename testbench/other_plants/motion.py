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
    MAXWELL_SLIP,
    MODES,
    STATES,
    Array,
    Axis,
    Place,
    Plant,
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
def _begin(p: Axis, q: float, bristle: float) -> tuple[Array, Array]:
    """State and modes of an axis that stands at q."""
    y, modes = np.zeros(STATES), np.zeros(MODES)
    y[0], modes[_PLAY] = q, q
    for k in (_QL, _R, _R + 2):
        y[k] = q
    if p.law == MAXWELL_SLIP:
        for k in range(4):
            y[2 + k] = bristle * 0.25 * p.coulomb
    else:
        y[2] = bristle * min(p.coulomb, p.static) / p.stiffness
    return y, modes


@numba.njit(cache=True, error_model="numpy")
def _rates(plant: Plant, place: Place, y: Array, dy: Array, modes: Array, u: float, t: float) -> None:
    p = plant.axis
    against = resistance(plant, place, y, dy, modes, y[0], y[1], t)
    dy[0] = y[1]
    dy[1] = (u * (1.0 - p.saturation * abs(u)) - against) / (p.inertia + p.payload_inertia * place.payload)


@numba.njit(cache=True, error_model="numpy")
def drive_axis(
    plant: Plant,
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
    p = plant.axis
    y, modes = _begin(p, wanted[0], bristle)
    dy, middle, total = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    out = np.empty((len(wanted), 4))
    summed = resistance(plant, place, y, dy, modes, y[0], 0.0, place.start)
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
            _rates(plant, place, y, dy, modes, u, s)
            if part == 0:
                out[k, 3] = dy[1]
            total[:] = dy
            for reach, weight in ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
                for j in range(STATES):
                    middle[j] = y[j] + reach * h * dy[j]
                _rates(plant, place, middle, dy, modes, u, s + reach * h)
                for j in range(STATES):
                    total[j] += weight * dy[j]
            for j in range(STATES):
                y[j] += h / 6.0 * total[j]
            settle_modes(plant, place, y, modes, y[0], y[1], s + h, h)
    return out


@numba.njit(cache=True, error_model="numpy")
def needed_torque(plant: Plant, place: Place, motion: Array, bristle: float, rest: int) -> Array:
    """Torque K i that a known motion asks for (inverse dynamics), of each row of `drive_axis`."""
    p = plant.axis
    y, modes = _begin(p, motion[0, 0], bristle)
    dy, middle, total = np.zeros(STATES), np.zeros(STATES), np.zeros(STATES)
    out = np.empty(len(motion))
    inertia = p.inertia + p.payload_inertia * place.payload
    for k in range(len(motion)):
        t = place.start + (k - rest) * TICK
        q0, w0 = motion[k, 0], motion[k, 1]
        against = resistance(plant, place, y, dy, modes, q0, w0, t) + inertia * motion[k, 3]
        kappa = p.saturation
        if kappa > 0.0:
            size = (1.0 - np.sqrt(max(1.0 - 4.0 * kappa * abs(against), 0.0))) / (2.0 * kappa)
            against = np.sign(against) * size
        out[k] = against
        if k + 1 == len(motion):
            break
        dq, dw = motion[k + 1, 0] - q0, motion[k + 1, 1] - w0
        parts = substeps(p, 0.5 * (w0 + motion[k + 1, 1]), TICK, False)
        h = TICK / parts
        for part in range(parts):
            s, e = part / parts, (part + 1) / parts
            m = 0.5 * (s + e)
            resistance(plant, place, y, dy, modes, q0 + s * dq, w0 + s * dw, t)
            total[:] = dy
            for reach, weight, x in ((0.5, 2.0, m), (0.5, 2.0, m), (1.0, 1.0, e)):
                for j in range(2, STATES):
                    middle[j] = y[j] + reach * h * dy[j]
                resistance(plant, place, middle, dy, modes, q0 + x * dq, w0 + x * dw, t)
                for j in range(2, STATES):
                    total[j] += weight * dy[j]
            for j in range(2, STATES):
                y[j] += h / 6.0 * total[j]
            settle_modes(plant, place, y, modes, q0 + e * dq, w0 + e * dw, t + e * TICK, h)
    return out
