"""A servo axis, its drive and the hand on it, for the study of hand guiding.

Runge-Kutta of fourth order in steps of 0.2 ms. Three friction laws beside viscous friction, so that none is
the one that the estimator knows: LuGre (Canudas de Wit et al. 1995), elasto-plastic (Dupont et al. 2002), and
Maxwell slip elements that share a velocity-dependent level (after Al-Bender et al. 2005). The drive is a
cascade in samples of 1 ms: position P with a limit of acceleration, velocity PI on the filtered difference of
its encoder, a current in steps. What the bus reports comes late and in counts.

The hand is a mass that an arm (spring and damper, or a force) moves, and that holds the slide by stiff skin.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from idtool.model.motion import Array

STEP_S = 2e-4
#: Steps of the drive's own loop, and of what is kept for readings that come late.
_DRIVE_STEPS = 5
LUGRE, ELASTO_PLASTIC, MAXWELL = range(3)
#: Where the Maxwell elements slip, in presliding lengths, and the share of the level that each holds.
_SLIPS = np.array([0.25, 0.5, 0.9, 1.5, 2.6])
_SHARE = 1.0 / len(_SLIPS)
GRAVITY = 9.80665
#: Steps of a DYNAMIXEL's readings (X series, e-Manual): rad, rad/s, A.
COUNT = 2.0 * math.pi / 4096
RPM_STEP = 0.229 * 2.0 * math.pi / 60.0
CURRENT_STEP = 2.69e-3


class Plant(NamedTuple):
    """One axis on one day; SI at the shaft, hand at the slide."""

    torque_constant: float
    inertia: float
    weight: float  # gravity torque with the payload that it really carries
    ratio: float  # travel of the slide, m per rad
    friction: int
    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float
    presliding: float  # rad
    bristle_damping: float
    uneven: float  # friction forward over the mean, less 1; the opposite backward
    along: float  # friction level along the stroke: 1 + along sin(q + 0.7)
    ripple: float
    ripple_cycles: float
    ripple_phase: float
    # drive
    position_gain: float
    velocity_gain: float
    integral_gain: float
    acceleration: float
    speed_limit: float
    current_limit: float
    command_delay: float
    # readings
    motion_delay: float
    current_delay: float
    stop_low: float
    stop_high: float


# Entries of the state: what is integrated, then what the drive holds.
Q, W, Z, HAND, HAND_RATE = range(5)
CURRENT, INTEGRAL, REFERENCE, MEASURED, LAST_Q, TIME, GRIPPED, GRASP, WORK, WRITE = range(5, 15)
MAXWELL_0 = 15
STATE = MAXWELL_0 + len(_SLIPS)
#: Of one period of a hand's script (`hands`).
GRIP, STIFFNESS, DAMPING, PLACE, RATE, FORCE, LOAD, LEAVE, TARE, MARK = range(10)
SCRIPT = 10
HAND_MASS = 0.25
SKIN, SKIN_DAMPING = 8000.0, 30.0
#: Kept, once per ms: position, speed, current, force of the hand on the slide.
KEPT = 4
_PAST = 128


@numba.njit(cache=True)
def level_of(p: Plant, q: float, w: float) -> float:
    """Friction level without its viscous part."""
    ratio = w / p.stribeck_velocity
    level = p.coulomb + (p.static - p.coulomb) / (1.0 + ratio * ratio * (1.0 + 0.5 * ratio * ratio))
    side = math.tanh(w / (0.05 * p.stribeck_velocity))
    result: float = level * (1.0 + p.uneven * side) * (1.0 + p.along * math.sin(q + 0.7))
    return result


@numba.njit(cache=True)
def _bristle_rate(p: Plant, q: float, w: float, z: float) -> float:
    level = level_of(p, q, w)
    stiffness = max(p.coulomb, p.static) / p.presliding
    steady = level / stiffness
    if p.friction == LUGRE:
        return w - abs(w) * z / steady
    # elasto-plastic: nothing slips below the break-away deflection
    away, size = 0.6 * steady, abs(z)
    slip = 0.0
    if z * w > 0.0 and size > away:
        slip = 1.0 if size >= steady else 0.5 * (1.0 - math.cos(math.pi * (size - away) / (steady - away)))
    return w * (1.0 - slip * size / steady)


@numba.njit(cache=True)
def _rates(
    p: Plant, y: Array, motor: float, maxwell: float, arm: Array, load: float, gripped: bool, dy: Array
) -> float:
    """Derivative of (q, w, z, hand, hand's rate); returns the hand's torque on the shaft."""
    q, w, z = y[Q], y[W], y[Z]
    rate = _bristle_rate(p, q, w, z) if p.friction != MAXWELL else w
    stiffness = max(p.coulomb, p.static) / p.presliding
    side = math.tanh(w / (0.05 * p.stribeck_velocity))
    friction = p.viscous * (1.0 + p.uneven * side) * w
    friction += maxwell if p.friction == MAXWELL else stiffness * z + p.bristle_damping * rate
    hand = 0.0
    dy[HAND], dy[HAND_RATE] = 0.0, 0.0
    if gripped:
        skin = SKIN * (y[HAND] - p.ratio * q) + SKIN_DAMPING * (y[HAND_RATE] - p.ratio * w)
        pull = arm[0] * (arm[2] - y[HAND]) + arm[1] * (arm[3] - y[HAND_RATE]) + arm[4]
        dy[HAND] = y[HAND_RATE]
        dy[HAND_RATE] = (pull - skin) / HAND_MASS
        hand = skin * p.ratio
    rest = p.weight + load * p.ratio * GRAVITY
    rest += p.ripple * math.sin(p.ripple_cycles * q + p.ripple_phase)
    if q > p.stop_high:
        rest += 400.0 * (q - p.stop_high) + 0.3 * w
    elif q < p.stop_low:
        rest += 400.0 * (q - p.stop_low) + 0.3 * w
    dy[Q] = w
    dy[W] = (motor + hand - rest - friction) / (p.inertia + load * p.ratio * p.ratio)
    dy[Z] = rate
    return hand


@numba.njit(cache=True)
def _drive(p: Plant, s: Array, goal: float, speed_mode: bool) -> None:
    """One sample of the drive, 1 ms."""
    step = _DRIVE_STEPS * STEP_S
    q = s[Q]
    s[MEASURED] += 0.25 * ((q - s[LAST_Q]) / step - s[MEASURED])
    s[LAST_Q] = q
    wanted = goal if speed_mode else p.position_gain * (goal - q)
    wanted = min(max(wanted, -p.speed_limit), p.speed_limit)
    most = p.acceleration * step
    s[REFERENCE] += min(max(wanted - s[REFERENCE], -most), most)
    error = s[REFERENCE] - s[MEASURED]
    torque = p.velocity_gain * error + s[INTEGRAL]
    limit = p.torque_constant * p.current_limit
    if abs(torque) < limit or torque * error < 0.0:
        s[INTEGRAL] += step * p.integral_gain * error
    current = min(max(torque, -limit), limit) / p.torque_constant
    s[CURRENT] = round(current / (0.25 * CURRENT_STEP)) * 0.25 * CURRENT_STEP


@numba.njit(cache=True)
def advance(
    p: Plant, s: Array, past: Array, row: Array, after: Array, before: float, command: float,
    speed_mode: bool, steps: int, kept: Array, at: int,
) -> None:  # fmt: skip
    """One period.

    Args:
        p, s: the plant and its state, shape (STATE,), changed.
        past: a ring of what readings may still ask for, once per ms, shape (KEPT, _PAST); changed.
        row, after: the script of this period and of the next, shape (SCRIPT,) each.
        before: the command of the period before, in force for `command_delay`.
        command: position, rad, or speed, rad/s, in `speed_mode`.
        steps: of STEP_S.
        kept, at: what is kept once per ms, shape (KEPT, ms), from that column on.
    """
    y, mid, total = np.empty(5), np.empty(5), np.empty(5)
    dy, arm = np.empty(5), np.empty(5)
    for i in range(steps):
        share = i / steps
        if i % _DRIVE_STEPS == 0:
            _drive(p, s, before if i * STEP_S < p.command_delay else command, speed_mode)
        if row[GRIP] > 0.0 and s[GRIPPED] == 0.0:
            s[GRIPPED] = 1.0
            s[GRASP] = s[HAND] = p.ratio * s[Q]
            s[HAND_RATE] = p.ratio * s[W]
        elif row[GRIP] == 0.0 and s[GRIPPED] != 0.0:
            s[GRIPPED] = 0.0
        if row[LEAVE] > 0.0 and s[GRIPPED] > 0.0 and abs(p.ratio * s[Q] - s[GRASP]) > row[LEAVE]:
            s[GRIPPED] = -1.0  # has left, though its script goes on
        gripped = s[GRIPPED] > 0.0
        arm[0], arm[1] = row[STIFFNESS], row[DAMPING]
        joined = after[GRIP] > 0.0  # the last period of a grip ends as it began
        for j in range(3):
            first, last = row[PLACE + j], after[PLACE + j] if joined else row[PLACE + j]
            arm[2 + j] = first + share * (last - first)
        arm[2] += s[GRASP]
        motor = p.torque_constant * s[CURRENT]
        maxwell = 0.0
        if p.friction == MAXWELL:
            for k in range(len(_SLIPS)):
                maxwell += s[MAXWELL_0 + k]
            maxwell += p.bristle_damping * 0.1 * s[W]
        for j in range(5):
            y[j] = s[j]
        hand = _rates(p, y, motor, maxwell, arm, row[LOAD], gripped, dy)
        for j in range(5):
            total[j] = dy[j]
        for stage in range(3):
            reach, weight = (STEP_S, 1.0) if stage == 2 else (0.5 * STEP_S, 2.0)
            for j in range(5):
                mid[j] = y[j] + reach * dy[j]
            _rates(p, mid, motor, maxwell, arm, row[LOAD], gripped, dy)
            for j in range(5):
                total[j] += weight * dy[j]
        for j in range(5):
            s[j] = y[j] + STEP_S / 6.0 * total[j]
        s[WORK] += hand * (s[Q] - y[Q])
        if p.friction == MAXWELL:
            level = level_of(p, s[Q], s[W])
            stiffness = max(p.coulomb, p.static) / p.presliding
            for k in range(len(_SLIPS)):
                most = _SHARE * level
                bent = s[MAXWELL_0 + k] + stiffness * _SHARE / _SLIPS[k] * (s[Q] - y[Q])
                s[MAXWELL_0 + k] = min(max(bent, -most), most)
        s[TIME] += STEP_S
        if (i + 1) % _DRIVE_STEPS == 0:
            column = at + i // _DRIVE_STEPS
            kept[0, column], kept[1, column] = s[Q], s[W]
            kept[2, column], kept[3, column] = s[CURRENT], hand / p.ratio
            write = int(s[WRITE])
            past[0, write], past[1, write], past[2, write] = s[Q], s[MEASURED], s[CURRENT]
            s[WRITE] = (write + 1) % _PAST


@numba.njit(cache=True)
def reading(p: Plant, s: Array, past: Array, noise: Array, apart: int) -> tuple[float, float, float]:
    """Position, speed and the mean of two readings of the current, `apart` ms one after the other."""
    last = int(s[WRITE]) - 1
    motion = (last - round(1e3 * p.motion_delay)) % _PAST
    q = round(past[0, motion] / COUNT) * COUNT
    w = round((past[1, motion] + 0.3 * RPM_STEP * noise[0]) / RPM_STEP) * RPM_STEP
    current = 0.0
    for k in range(2):
        then = (last - round(1e3 * p.current_delay) - k * apart) % _PAST
        current += 0.5 * round((past[2, then] + CURRENT_STEP * noise[1 + k]) / CURRENT_STEP) * CURRENT_STEP
    return q, w, current


@numba.njit(cache=True)
def follow(
    p: Plant, s: Array, past: Array, before: float, commands: Array, speed_mode: bool, noise: Array
) -> Array:
    """Readings at the end of every period of 5 ms without a hand, shape (periods, 3)."""
    nobody, kept = np.zeros(SCRIPT), np.empty((KEPT, 5))
    rows = np.empty((len(commands), 3))
    for k in range(len(commands)):
        advance(p, s, past, nobody, nobody, before, commands[k], speed_mode, round(0.005 / STEP_S), kept, 0)
        before = commands[k]
        rows[k] = reading(p, s, past, noise[k], 2)
    return rows


def at_rest(p: Plant, q: float, bent: float) -> tuple[Array, Array]:
    """State and past of an axis that stands at q; `bent`: share of the static level in its bristle."""
    s = np.zeros(STATE)
    s[Q] = s[LAST_Q] = q
    held = bent * p.static
    if p.friction == MAXWELL:
        s[MAXWELL_0:] = held * _SHARE
    else:
        s[Z] = held * p.presliding / max(p.coulomb, p.static)
    s[INTEGRAL] = p.weight + p.ripple * math.sin(p.ripple_cycles * q + p.ripple_phase) + held
    s[CURRENT] = s[INTEGRAL] / p.torque_constant
    past = np.zeros((KEPT, _PAST))
    past[0], past[2] = q, s[CURRENT]
    return s, past
