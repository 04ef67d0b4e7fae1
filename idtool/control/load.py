"""What the motor must carry, one sample at a time, compiled: gravity, LuGre friction, every effect.

The same model as `idtool.model.torque.predict`, row for row (a test holds the two together), on scalars
and two arrays: `numbers`, which a parameter file fills once, and `memory`, which a sample changes. Effects
are asked by their own formulas (`Effect.at`). One that is not named here is evaluated by its own class and
handed in through `memory` (see `online`): slower, and the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from idtool.effects import (
    backlash,
    breakaway_dwell,
    compliance,
    direction_asymmetry,
    drive_backdrive,
    external_periodic,
    hysteresis,
    inertia,
    load_dependent_friction,
    nonlinear_viscous,
    position_dependent_friction,
    position_ripple,
    position_stiffness,
    stribeck_shape,
    thermal_drift,
    tilt_misalignment,
    torque_constant_saturation,
    torque_offset,
    transport_delay,
)
from idtool.effects.base import Effect, Values
from idtool.model.contribution import (
    BRISTLE_CHANGE,
    DELAY,
    EXPONENT_CHANGE,
    FIELDS,
    GAIN_CHANGE,
    LEVEL_CHANGE,
    LEVEL_TORQUE,
    SATURATION,
    STATIC_CHANGE,
    TORQUE,
    VISCOUS_CHANGE,
)
from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.model.row import Row
from idtool.model.stribeck import EXPONENT, least_level
from idtool.parameters import Parameters

#: Presliding travel assumed where the file has a friction level but no bristle, rad (m). Under an
#: encoder count of any servo, so that friction then acts as plain Coulomb friction.
_RIGID_PRESLIDING = 1e-4
#: Below this exponent 1 - exp(-x) loses its digits and its series is exact enough.
_SMALL = 1e-5

# Entries of `numbers`. Then each effect: which one, how many numbers, where its memory begins, the numbers.
ARM, GRAVITY_1, GRAVITY_2 = range(3)
COULOMB, STATIC, STRIBECK, VISCOUS, SIGMA0, SIGMA1, FLOOR = range(3, 10)
TORQUE_CONSTANT = 10
#: How many effects, the first ones, hold a part of the friction levels in place of the bristle: what share of
#: the level, and the travel over which they yield.
HOLDING, HELD_SHARE, HELD_REACH = 11, 12, 13
_EFFECTS, _HEAD = 14, 3

# Entries of `memory`: what outlives a sample, what all effects added at the last one, what they add now, what
# those of them add that are not compiled, and the memory of each that is.
BEGUN, BRISTLE, LAST_VELOCITY = range(3)
LAST_SUM = 3
SUM = LAST_SUM + len(FIELDS)
OUTSIDE = SUM + len(FIELDS)
_OWN = OUTSIDE + len(FIELDS)

#: Effects whose formulas are compiled, as `_add` numbers them.
_NAMES = (
    "inertia",
    "torque_offset",
    "direction_asymmetry",
    "nonlinear_viscous",
    "transport_delay",
    "torque_constant_saturation",
    "stribeck_shape",
    "load_dependent_friction",
    "drive_backdrive",
    "tilt_misalignment",
    "position_stiffness",
    "position_dependent_friction",
    "hysteresis",
    "backlash",
    "compliance",
    "breakaway_dwell",
    "thermal_drift",
    "position_ripple",
    "external_periodic",
)


@jit()
def _add(which: int, row: Row, n: Array, memory: Array, total: Array) -> None:
    """What an effect adds, by its own formula."""
    if which == 0:
        inertia.at(row, n, memory, total)
    elif which == 1:
        torque_offset.at(row, n, memory, total)
    elif which == 2:
        direction_asymmetry.at(row, n, memory, total)
    elif which == 3:
        nonlinear_viscous.at(row, n, memory, total)
    elif which == 4:
        transport_delay.at(row, n, memory, total)
    elif which == 5:
        torque_constant_saturation.at(row, n, memory, total)
    elif which == 6:
        stribeck_shape.at(row, n, memory, total)
    elif which == 7:
        load_dependent_friction.at(row, n, memory, total)
    elif which == 8:
        drive_backdrive.at(row, n, memory, total)
    elif which == 9:
        tilt_misalignment.at(row, n, memory, total)
    elif which == 10:
        position_stiffness.at(row, n, memory, total)
    elif which == 11:
        position_dependent_friction.at(row, n, memory, total)
    elif which == 12:
        hysteresis.at(row, n, memory, total)
    elif which == 13:
        backlash.at(row, n, memory, total)
    elif which == 14:
        compliance.at(row, n, memory, total)
    elif which == 15:
        breakaway_dwell.at(row, n, memory, total)
    elif which == 16:
        thermal_drift.at(row, n, memory, total)
    elif which == 17:
        position_ripple.at(row, n, memory, total)
    elif which == 18:
        external_periodic.at(row, n, memory, total)


def compiled(effect: str) -> bool:
    """Whether the formula of an effect is compiled here."""
    return effect in _NAMES


def numbers_of(
    parameters: Parameters, effects: Sequence[tuple[Effect, Values]], torque_constant: float
) -> Array:
    """`numbers` of a file with these effects (values of the fit: `Effect.to_values`). Float64."""
    n = np.zeros(_EFFECTS)
    n[ARM] = parameters.gravity_model == "arm"
    if not parameters.weightless:
        n[GRAVITY_1 : GRAVITY_2 + 1] = [p.value for p in parameters.gravity.values()]
    static = parameters.static
    n[COULOMB : VISCOUS + 1] = [
        static[k].value for k in ("coulomb", "static", "stribeck_velocity", "viscous")
    ]
    if parameters.axis.reading == "voltage" and parameters.axis.effort == "torque":
        n[VISCOUS] += parameters.axis.back_emf_damping  # the voltage makes up for it
    if parameters.dynamic:
        n[SIGMA0] = parameters.dynamic["bristle_stiffness"].value
        n[SIGMA1] = parameters.dynamic["bristle_damping"].value
    else:
        n[SIGMA0] = max(n[COULOMB], n[STATIC], 1e-9) / _RIGID_PRESLIDING
    n[FLOOR] = least_level(n[COULOMB], n[STATIC])
    n[TORQUE_CONSTANT] = torque_constant
    held = [effect.holds(values) for effect, values in effects]
    level = sum(part for part, _ in held)
    n[HOLDING] = sum(part > 0.0 for part, _ in held)
    n[HELD_SHARE] = min(level / max(n[COULOMB], 1e-9), 1.0)
    n[HELD_REACH] = level / sum(per_travel for _, per_travel in held) if level > 0.0 else 1.0
    own: list[float] = []
    place = _OWN
    for effect, values in sorted(effects, key=lambda one: one[0].holds(one[1])[0] <= 0.0):
        numbers = effect.numbers(values)
        own += [_NAMES.index(effect.name), len(numbers), place, *numbers]
        place += effect.memory
    return np.concatenate([n, own])


def memory_of(effects: Iterable[tuple[Effect, Values]]) -> Array:
    """`memory` for these effects, before anything moved. Float64."""
    return np.zeros(_OWN + sum(effect.memory for effect, _ in effects))


@jit()
def gravity_of(n: Array, position: float, payload: float) -> float:
    """Gravity torque of an axis that stands upright, N m (N)."""
    first: float = n[GRAVITY_1]
    second: float = n[GRAVITY_2]
    if n[ARM] != 0.0:
        return first * math.sin(position) + second * math.cos(position)
    return first + second * payload


@jit()
def _level(n: Array, velocity: float, change: float, torque: float, static: float, exponent: float) -> float:
    """Friction level g, with what the effects change about it."""
    ratio = abs(velocity) / n[STRIBECK]
    power = ratio * ratio if exponent == 0.0 else ratio ** (EXPONENT + exponent)
    plain = n[COULOMB] + (n[STATIC] * (1.0 + static) - n[COULOMB]) * math.exp(-min(power, 700.0))
    level: float = max(plain * (1.0 + change) + torque, n[FLOOR])
    return level


@jit()
def _sum_up(n: Array, m: Array, row: Row) -> float:
    """Ask every effect; their memory is moved on. Returns what holds a part of the friction levels."""
    total = m[SUM:OUTSIDE]
    total[:] = m[OUTSIDE:_OWN]
    outside, held = total[TORQUE], 0.0
    k, asked = _EFFECTS, 0
    while k < len(n):
        which, numbers, place = int(n[k]), k + _HEAD, int(n[k + 2])
        k = numbers + int(n[k + 1])
        _add(which, row, n[numbers:k], m[place:], total)
        asked += 1
        if asked == n[HOLDING]:
            held = total[TORQUE] - outside
    return held


@jit()
def _advance_bristle(n: Array, m: Array, step: float, velocity: float, travel: float) -> float:
    """Move the bristle over the step that ends now; returns the share of its deflection that is kept."""
    # the bristle sees the mean of the step's two ends, as in the batch model
    middle = 0.5 * (velocity + m[LAST_VELOCITY]) if math.isnan(travel) else travel / max(step, 1e-9)
    mean_level = _level(
        n,
        middle,
        0.5 * (m[LAST_SUM + LEVEL_CHANGE] + m[SUM + LEVEL_CHANGE]),
        0.5 * (m[LAST_SUM + LEVEL_TORQUE] + m[SUM + LEVEL_TORQUE]),
        0.5 * (m[LAST_SUM + STATIC_CHANGE] + m[SUM + STATIC_CHANGE]),
        0.5 * (m[LAST_SUM + EXPONENT_CHANGE] + m[SUM + EXPONENT_CHANGE]),
    )
    # exact step for a velocity held over the step (see `idtool.model.lugre`)
    rho = n[SIGMA0] / mean_level
    x = rho * abs(middle) * step
    decay = math.exp(-min(x, 700.0))
    forced = math.copysign((1.0 - decay) / rho, middle) if x > _SMALL else middle * step * (1.0 - 0.5 * x)
    m[BRISTLE] = decay * m[BRISTLE] + forced
    return decay


class Instant(NamedTuple):
    """What the model is asked for, in the order in which `carry` takes it; SI, rad or m by the kind of axis.

    Attributes:
        time: s; effects that follow the clock read it.
        step: time since the sample before, s.
        position, velocity, acceleration: rad, rad/s, rad/s^2 (m ...).
        payload: kg.
        tilt_alpha, tilt_beta: rad.
        temperature: degrees Celsius, NaN if unknown.
        travel: change of position over the step. It drives the bristle if given: unlike a quantised velocity,
            its error does not add up. NaN: the mean of the two velocities does.
    """

    time: float
    step: float
    position: float
    velocity: float
    acceleration: float = 0.0
    payload: float = 0.0
    tilt_alpha: float = 0.0
    tilt_beta: float = 0.0
    temperature: float = math.nan
    travel: float = math.nan


@jit()
def carry(
    n: Array,
    m: Array,
    time: float,
    step: float,
    position: float,
    velocity: float,
    acceleration: float,
    payload: float,
    tilt_alpha: float,
    tilt_beta: float,
    temperature: float,
    travel: float,
) -> tuple[float, float, float, float, float, float, float, float, float, float, float]:
    """Advance the bristle over the step that ends now and return what the motor carries.

    Args:
        n, m: `numbers` and `memory`; `memory` is changed.
        time, step, position, velocity, acceleration, payload, tilt_alpha, tilt_beta, temperature, travel: a
            `Instant`, entry by entry: a compiled function takes floats far faster than a tuple of them.

    Returns:
        Gravity, elastic and damping share of the friction, additive effects, friction level (N m or N);
        saturation (per N m), change of the motor's gain, delay (s), deflection z (rad or m); the share of a
        deflection before that the step's travel kept, and the share of its torque that is felt at this speed.
    """
    upright = gravity_of(n, position, payload)
    load = upright if n[ARM] != 0.0 else upright * (math.cos(tilt_alpha) * math.cos(tilt_beta))
    row = Row(
        m[BEGUN] == 0.0,
        0.0,
        step,
        time,
        position,
        velocity,
        acceleration,
        payload,
        load,
        upright,
        tilt_alpha,
        tilt_beta,
        temperature,
        n[TORQUE_CONSTANT],
        0,
    )
    held = _sum_up(n, m, row)
    total = m[SUM:OUTSIDE]
    level = _level(
        n,
        velocity,
        total[LEVEL_CHANGE],
        total[LEVEL_TORQUE],
        total[STATIC_CHANGE],
        total[EXPONENT_CHANGE],
    )
    kept = 1.0
    if m[BEGUN] != 0.0:
        kept = _advance_bristle(n, m, step, velocity, travel)
        if n[HOLDING] > 0.0:
            way = abs(velocity) * step if math.isnan(travel) else abs(travel)
            kept += n[HELD_SHARE] * (math.exp(-min(way / n[HELD_REACH], 700.0)) - kept)
    m[BEGUN] = 1.0
    m[LAST_VELOCITY] = velocity
    m[LAST_SUM:SUM] = total

    z = m[BRISTLE]
    rate = velocity - n[SIGMA0] / level * abs(velocity) * z
    passed = 1.0 + total[BRISTLE_CHANGE]
    elastic = passed * n[SIGMA0] * z + held
    # a bristle that is bent slips, and what damps it acts on the slip too
    felt = max(1.0 - (1.0 - n[HELD_SHARE]) * n[SIGMA1] * abs(velocity) / level, -1.0)
    damping = passed * n[SIGMA1] * rate + n[VISCOUS] * (1.0 + total[VISCOUS_CHANGE]) * velocity
    saturation, gain = total[SATURATION], total[GAIN_CHANGE]
    return load, elastic, damping, total[TORQUE] - held, level, saturation, gain, total[DELAY], z, kept, felt
