"""What the motor must carry, one sample at a time, compiled: gravity, LuGre friction, every effect.

The same model as `idtool.model.torque.predict`, row for row (a test holds the two together), on scalars
and two arrays of fixed length: `numbers`, which a parameter file fills once, and `memory`, which a sample
changes. An effect that a file lacks has numbers that do nothing. An effect that is not written out here
is evaluated by its own class and handed in through `memory` (see `online`): slower, and the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numba
import numpy as np

from idtool.effects.backlash import free_share
from idtool.effects.breakaway_dwell import aged
from idtool.effects.compliance import swing
from idtool.effects.hysteresis import stretched
from idtool.effects.position_ripple import MOST_FAMILIES, family_prefix
from idtool.effects.position_stiffness import HIGHEST
from idtool.model.contribution import FIELDS
from idtool.model.motion import Array
from idtool.model.stribeck import EXPONENT
from idtool.parameters import Parameters

#: As in the batch model: effects never push the friction level below this share of its plain value.
_LEVEL_FLOOR = 0.02
#: Presliding travel assumed where the file has a friction level but no bristle, rad (m). Under an
#: encoder count of any servo, so that friction then acts as plain Coulomb friction.
_RIGID_PRESLIDING = 1e-4
#: Below this exponent 1 - exp(-x) loses its digits and its series is exact enough.
_SMALL = 1e-5

# Entries of `numbers`.
ARM, GRAVITY_1, GRAVITY_2 = range(3)
COULOMB, STATIC, STRIBECK, VISCOUS, SIGMA0, SIGMA1, FLOOR = range(3, 10)
INERTIA, OFFSET, ASYMMETRY, QUADRATIC, DELAY, SATURATION, EXPONENT_CHANGE = range(10, 17)
MU, MU_DRIVE, MU_BACKDRIVE, TILT_ALPHA, TILT_BETA, SPRING, PULL = range(17, 24)
SLOPE_1, SLOPE_2, CENTER, HALF_STROKE = range(24, 28)
RATE, REFERENCE, WARM_UP, WARM_TIME = range(28, 32)
GAP, SHARE_BEHIND, SHARE_AT_ONCE, SHARE_UNDER_LOAD, LOAD_SCALE = range(32, 37)
LOAD_INERTIA, OMEGA, DAMPING = range(37, 40)
FREQUENCY, SIN, COS = range(40, 43)
YIELD, REACH, OF_FRICTION = range(43, 46)
GAIN, DWELL_TIME, REST_SPEED, WEAR, STICTION_PER_LOAD = range(46, 51)
SLOPE_3, SLOPE_4 = range(51, 53)
SHAPE_2, SHAPE_CENTER, SHAPE_HALF = 53, 53 + HIGHEST - 1, 53 + HIGHEST  # of T_2, T_3, ...
RIPPLE = SHAPE_HALF + 1  # of each family: cycles, then the strengths of `_RIPPLE`
_RIPPLE = ("sin_1", "cos_1", "sin_2", "cos_2", "turned_sin_1", "turned_cos_1")
_PER_FAMILY = 1 + len(_RIPPLE)
NUMBERS = RIPPLE + MOST_FAMILIES * _PER_FAMILY

# Entries of `memory`; the last ones are what effects from outside add, in the order of FIELDS.
BEGUN, BRISTLE, LAST_VELOCITY, BEHIND, TWIST, TWIST_RATE, LAST_ACCELERATION = range(7)
STRETCH, LAST_POSITION, AGE = range(7, 10)
LAST_CHANGES = 10  # four numbers: what changes the friction level at the sample before
OUTSIDE = 14
MEMORY = OUTSIDE + len(FIELDS)

#: effect -> value of the fit -> entry of `numbers`
_EFFECTS: dict[str, dict[str, int]] = {
    "inertia": {"inertia": INERTIA},
    "torque_offset": {"offset": OFFSET},
    "direction_asymmetry": {"asymmetry": ASYMMETRY},
    "nonlinear_viscous": {"quadratic": QUADRATIC},
    "transport_delay": {"delay": DELAY},
    "torque_constant_saturation": {"kappa": SATURATION},
    "stribeck_shape": {"exponent": EXPONENT_CHANGE},
    "load_dependent_friction": {"mu": MU, "doubling_load": STICTION_PER_LOAD},
    "drive_backdrive": {"mu_drive": MU_DRIVE, "mu_backdrive": MU_BACKDRIVE},
    "tilt_misalignment": {"alpha": TILT_ALPHA, "beta": TILT_BETA},
    "position_stiffness": {
        "stiffness": SPRING,
        "pull": PULL,
        **{f"shape_{k}": SHAPE_2 + k - 2 for k in range(2, HIGHEST + 1)},
        "center": SHAPE_CENTER,
        "half_stroke": SHAPE_HALF,
    },
    "position_dependent_friction": {
        "slope_1": SLOPE_1,
        "slope_2": SLOPE_2,
        "slope_3": SLOPE_3,
        "slope_4": SLOPE_4,
        "center": CENTER,
        "half_stroke": HALF_STROKE,
    },
    "thermal_drift": {
        "rate": RATE,
        "reference": REFERENCE,
        "warm_up": WARM_UP,
        "time_constant": WARM_TIME,
    },
    "backlash": {
        "log_gap": GAP,
        "share_behind_gap": SHARE_BEHIND,
        "share_at_once": SHARE_AT_ONCE,
        "share_under_load": SHARE_UNDER_LOAD,
        "load_scale": LOAD_SCALE,
    },
    "compliance": {"load_inertia": LOAD_INERTIA, "log_omega": OMEGA, "damping_ratio": DAMPING},
    "position_ripple": {
        family_prefix(k + 1) + name: RIPPLE + k * _PER_FAMILY + place
        for k in range(MOST_FAMILIES)
        for place, name in enumerate(("cycles", *_RIPPLE))
    },
    "external_periodic": {"frequency": FREQUENCY, "sin": SIN, "cos": COS},
    "hysteresis": {"yield": YIELD, "log_reach": REACH, "of_friction": OF_FRICTION},
    "breakaway_dwell": {
        "gain": GAIN,
        "log_time_constant": DWELL_TIME,
        "rest_speed": REST_SPEED,
        "log_wear": WEAR,
    },
}
#: Values that `set_effect` writes in another way.
_TOLD_OTHERWISE = {"load_dependent_friction": {"doubling_load"}}
#: Entries that a fit holds as logarithms, and those that something is divided by.
_LOGARITHMS = (GAP, OMEGA, REACH, DWELL_TIME, WEAR)
_NEVER_ZERO = [HALF_STROKE, SHAPE_HALF, WARM_TIME, OMEGA, REACH, DWELL_TIME, WEAR]


def compiled(effect: str, values: Iterable[str]) -> bool:
    """Whether an effect is written out here, with all of its values."""
    return effect in _EFFECTS and set(values) <= set(_EFFECTS[effect]) | _TOLD_OTHERWISE.get(effect, set())


def numbers_of(parameters: Parameters) -> Array:
    """`numbers` of a file, without its effects. Shape (NUMBERS,), float64."""
    n = np.zeros(NUMBERS)
    n[ARM] = parameters.gravity_model == "arm"
    n[GRAVITY_1 : GRAVITY_2 + 1] = [p.value for p in parameters.gravity.values()]
    static = parameters.static
    n[COULOMB : VISCOUS + 1] = [
        static[k].value for k in ("coulomb", "static", "stribeck_velocity", "viscous")
    ]
    if parameters.dynamic:
        n[SIGMA0] = parameters.dynamic["bristle_stiffness"].value
        n[SIGMA1] = parameters.dynamic["bristle_damping"].value
    else:
        n[SIGMA0] = max(n[COULOMB], n[STATIC], 1e-9) / _RIGID_PRESLIDING
    n[FLOOR] = _LEVEL_FLOOR * min(n[COULOMB], n[STATIC]) + 1e-12
    n[_NEVER_ZERO] = 1.0
    return n


def set_effect(numbers: Array, effect: str, values: dict[str, float], torque_constant: float) -> None:
    """Write an effect into `numbers`; `values` are those of the fit (`Effect.to_values`)."""
    for name, entry in _EFFECTS[effect].items():
        if name in values:
            numbers[entry] = values[name]
    if effect == "stribeck_shape":
        numbers[EXPONENT_CHANGE] -= EXPONENT
    elif effect == "torque_constant_saturation":
        numbers[SATURATION] /= torque_constant
    elif effect == "load_dependent_friction" and "doubling_load" in values:
        numbers[STICTION_PER_LOAD] = 1.0 / values["doubling_load"]
    elif effect == "backlash" and "share_under_load" not in values:
        numbers[LOAD_SCALE] = 0.0
    for entry in _EFFECTS[effect].values():
        if entry in _LOGARITHMS:
            numbers[entry] = math.exp(numbers[entry])


def clear_effect(numbers: Array, effect: str) -> None:
    """Take an effect out again."""
    for entry in _EFFECTS.get(effect, {}).values():
        numbers[entry] = 1.0 if entry in _NEVER_ZERO else 0.0


@numba.njit(cache=True)
def gravity_of(n: Array, position: float, payload: float) -> float:
    """Gravity torque of an axis that stands upright, N m (N)."""
    first: float = n[GRAVITY_1]
    second: float = n[GRAVITY_2]
    if n[ARM] != 0.0:
        return first * math.sin(position) + second * math.cos(position)
    return first + second * payload


@numba.njit(cache=True)
def _level(n: Array, velocity: float, change: float, torque: float, static: float, exponent: float) -> float:
    """Friction level g, with what the effects change about it."""
    ratio = abs(velocity) / n[STRIBECK]
    power = ratio * ratio if exponent == 0.0 else ratio ** (EXPONENT + exponent)
    plain = n[COULOMB] + (n[STATIC] * (1.0 + static) - n[COULOMB]) * math.exp(-min(power, 700.0))
    level: float = max(plain * (1.0 + change) + torque, n[FLOOR])
    return level


@numba.njit(cache=True)
def _effects(
    n: Array,
    m: Array,
    time: float,
    step: float,
    position: float,
    velocity: float,
    acceleration: float,
    upright: float,
    tilt_alpha: float,
    tilt_beta: float,
    temperature: float,
) -> tuple[float, float, float, float, float, float, float]:
    """What the effects add: torque, change and torque of the friction level, change of the stiction, of the
    viscous friction, of the bristle, and of the Stribeck exponent; their memory in `m` is moved on."""
    w = abs(velocity)
    factor = math.cos(tilt_alpha) * math.cos(tilt_beta)
    load = upright if n[ARM] != 0.0 else upright * factor
    torque = m[OUTSIDE] + n[INERTIA] * acceleration + n[OFFSET] + n[ASYMMETRY] * w
    torque += n[QUADRATIC] * w * velocity + n[SPRING] * position + n[PULL]
    level_change, level_torque = m[OUTSIDE + 1], m[OUTSIDE + 2]
    static_change, viscous_change, bristle_change = m[OUTSIDE + 3], m[OUTSIDE + 4], m[OUTSIDE + 5]
    exponent_change = m[OUTSIDE + 6] + n[EXPONENT_CHANGE]
    level_torque += (n[MU] + (n[MU_DRIVE] if velocity * load > 0.0 else n[MU_BACKDRIVE])) * abs(load)
    static_change += n[STICTION_PER_LOAD] * abs(load)
    if n[TILT_ALPHA] != 0.0 or n[TILT_BETA] != 0.0:
        true = math.cos(tilt_alpha + n[TILT_ALPHA]) * math.cos(tilt_beta + n[TILT_BETA])
        torque += upright * (true - factor)
    x = min(max((position - n[CENTER]) / n[HALF_STROKE], -1.0), 1.0)
    square = x * x
    level_change += n[SLOPE_1] * x + n[SLOPE_2] * (2.0 * square - 1.0)
    level_change += n[SLOPE_3] * (4.0 * square - 3.0) * x + n[SLOPE_4] * (8.0 * square * (square - 1.0) + 1.0)
    x = min(max((position - n[SHAPE_CENTER]) / n[SHAPE_HALF], -1.0), 1.0)
    before, now = 1.0, x
    for k in range(SHAPE_2, SHAPE_CENTER):
        before, now = now, 2.0 * x * now - before
        torque += n[k] * now
    if n[RATE] != 0.0 and not math.isnan(temperature):
        warm = math.expm1(-n[RATE] * (temperature - n[REFERENCE]))
        level_change += warm
        viscous_change += warm
    elif n[WARM_UP] != 0.0:
        warm = math.expm1(n[WARM_UP] * math.expm1(-time / n[WARM_TIME]))
        level_change += warm
        viscous_change += warm
    for k in range(RIPPLE, NUMBERS, _PER_FAMILY):
        if n[k] == 0.0:
            break
        s, c = math.sin(n[k] * position), math.cos(n[k] * position)
        torque += n[k + 1] * s + n[k + 2] * c + 2.0 * n[k + 3] * s * c + n[k + 4] * (c * c - s * s)
        level_torque += n[k + 5] * s + n[k + 6] * c
    if n[FREQUENCY] != 0.0:
        angle = 2.0 * math.pi * n[FREQUENCY] * time
        torque += n[SIN] * math.sin(angle) + n[COS] * math.cos(angle)
    if n[GAP] != 0.0:
        if m[BEGUN] == 0.0:
            m[BEHIND] = position
        m[BEHIND], free = free_share(m[BEHIND], position, velocity, 0.5 * n[GAP])
        share = n[SHARE_BEHIND]
        if n[LOAD_SCALE] > 0.0:
            unloaded = math.exp(-abs(load) / n[LOAD_SCALE])
            share = share * unloaded + n[SHARE_UNDER_LOAD] * (1.0 - unloaded)
        level_change -= share * free
        bristle_change -= n[SHARE_AT_ONCE] * free
    if n[LOAD_INERTIA] != 0.0:
        if m[BEGUN] == 0.0:
            m[TWIST], m[TWIST_RATE] = -acceleration / (n[OMEGA] * n[OMEGA]), 0.0
        else:
            mean = 0.5 * (acceleration + m[LAST_ACCELERATION])
            m[TWIST], m[TWIST_RATE] = swing(m[TWIST], m[TWIST_RATE], mean, step, n[OMEGA], n[DAMPING])
        m[LAST_ACCELERATION] = acceleration
        pull = -n[OMEGA] * n[OMEGA] * m[TWIST] - 2.0 * n[DAMPING] * n[OMEGA] * m[TWIST_RATE]
        torque += n[LOAD_INERTIA] * (pull - acceleration)
    if n[YIELD] != 0.0:
        m[STRETCH] = 0.0 if m[BEGUN] == 0.0 else stretched(m[STRETCH], position - m[LAST_POSITION], n[REACH])
        m[LAST_POSITION] = position
        torque += n[YIELD] * m[STRETCH]
        level_torque -= n[YIELD] * n[OF_FRICTION]
    if n[GAIN] != 0.0:
        m[AGE] = 0.5 if m[BEGUN] == 0.0 else aged(m[AGE], w, step, n[REST_SPEED], n[WEAR], n[DWELL_TIME])
        static_change += n[GAIN] * m[AGE]
    return torque, level_change, level_torque, static_change, viscous_change, bristle_change, exponent_change


@numba.njit(cache=True)
def _advance_bristle(
    n: Array,
    m: Array,
    step: float,
    velocity: float,
    travel: float,
    level_change: float,
    level_torque: float,
    static_change: float,
    exponent_change: float,
) -> float:
    """Move the bristle over the step that ends now; returns the share of its deflection that is kept."""
    # the bristle sees the mean of the step's two ends, as in the batch model
    middle = 0.5 * (velocity + m[LAST_VELOCITY]) if math.isnan(travel) else travel / max(step, 1e-9)
    mean_level = _level(
        n,
        middle,
        0.5 * (level_change + m[LAST_CHANGES]),
        0.5 * (level_torque + m[LAST_CHANGES + 1]),
        0.5 * (static_change + m[LAST_CHANGES + 2]),
        0.5 * (exponent_change + m[LAST_CHANGES + 3]),
    )
    # exact step for a velocity held over the step (see `idtool.model.lugre`)
    rho = n[SIGMA0] / mean_level
    x = rho * abs(middle) * step
    decay = math.exp(-min(x, 700.0))
    forced = math.copysign((1.0 - decay) / rho, middle) if x > _SMALL else middle * step * (1.0 - 0.5 * x)
    m[BRISTLE] = decay * m[BRISTLE] + forced
    return decay


@numba.njit(cache=True)
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
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Advance the bristle over the step that ends now and return what the motor carries.

    Args:
        n, m: `numbers` and `memory`; `memory` is changed.
        time: s; effects that follow the clock read it.
        step: time since the sample before, s.
        position, velocity, acceleration: rad, rad/s, rad/s^2 (m ...).
        payload: kg.
        tilt_alpha, tilt_beta: rad.
        temperature: degrees Celsius, NaN if unknown.
        travel: change of position over the step, NaN if the mean velocity is to drive the bristle.

    Returns:
        Gravity, elastic and damping share of the friction, additive effects, friction level (N m or N);
        saturation (per N m), delay (s), deflection z (rad or m), and the share of it before that the step's
        travel kept.
    """
    upright = gravity_of(n, position, payload)
    load = upright if n[ARM] != 0.0 else upright * (math.cos(tilt_alpha) * math.cos(tilt_beta))
    torque, level_change, level_torque, static_change, viscous_change, bristle_change, exponent_change = (
        _effects(
            n, m, time, step, position, velocity, acceleration, upright, tilt_alpha, tilt_beta, temperature
        )
    )
    level = _level(n, velocity, level_change, level_torque, static_change, exponent_change)
    decay = 1.0
    if m[BEGUN] != 0.0:
        decay = _advance_bristle(
            n, m, step, velocity, travel, level_change, level_torque, static_change, exponent_change
        )
    m[BEGUN] = 1.0
    m[LAST_VELOCITY] = velocity
    m[LAST_CHANGES], m[LAST_CHANGES + 1] = level_change, level_torque
    m[LAST_CHANGES + 2], m[LAST_CHANGES + 3] = static_change, exponent_change

    z = m[BRISTLE]
    rate = velocity - n[SIGMA0] / level * abs(velocity) * z
    elastic = (1.0 + bristle_change) * n[SIGMA0] * z
    damping = (1.0 + bristle_change) * n[SIGMA1] * rate + n[VISCOUS] * (1.0 + viscous_change) * velocity
    saturation = n[SATURATION] + m[OUTSIDE + 8]
    return load, elastic, damping, torque, level, saturation, n[DELAY] + m[OUTSIDE + 7], z, decay


assert FIELDS == (
    "torque",
    "level_change",
    "level_torque",
    "static_change",
    "viscous_change",
    "bristle_change",
    "exponent_change",
    "delay",
    "saturation",
)
