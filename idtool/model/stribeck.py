"""The static friction curve (paper Eq. 9)."""

from __future__ import annotations

from typing import Any, overload

import numpy as np

from idtool.model.jit import jit
from idtool.model.motion import Array

#: The paper's exponent; the effect `stribeck_shape` frees it.
EXPONENT = 2.0
#: The friction level never falls below this share of its plain value, whatever effects do to it: what it
#: divides by must stay above zero.
_FLOOR = 0.02


@jit()
def least_level(coulomb: float, static: float) -> float:
    """Where the friction level ends that effects take off, N m (N)."""
    return _FLOOR * min(coulomb, static) + 1e-12


@overload
def level(
    velocity: Array, coulomb: float, static: float, stribeck_velocity: float, exponent: float = ...
) -> Array: ...
@overload
def level(
    velocity: float, coulomb: float, static: float, stribeck_velocity: float, exponent: float = ...
) -> float: ...
def level(
    velocity: Array | float,
    coulomb: float,
    static: float,
    stribeck_velocity: float,
    exponent: float = EXPONENT,
) -> Array | float:
    """g(w) = coulomb + (static - coulomb) exp(-|w / stribeck_velocity|^exponent), N m (N)."""
    curve: Array | float = faded(fading(velocity, stribeck_velocity, exponent), coulomb, static)
    return curve


def faded(fade: Any, coulomb: float, static: float) -> Any:
    """g where the static level has faded so far (`fading`), N m (N)."""
    return fade * (static - coulomb) + coulomb


def fading(velocity: Array | float, stribeck_velocity: float, exponent: float = EXPONENT) -> Any:
    """exp(-|w / stribeck_velocity|^exponent), by which the static level fades, shape of `velocity`."""
    fade = velocity / stribeck_velocity
    room = fade if isinstance(fade, np.ndarray) else None  # a search asks for all rows again and again
    power = np.square(fade, out=room) if exponent == EXPONENT else np.abs(fade) ** exponent
    return np.exp(np.negative(power, out=room), out=room)


def steady(velocity: Array, coulomb: float, static: float, stribeck_velocity: float, viscous: float) -> Array:
    """Steady friction torque g(w) sgn(w) + viscous w, N m (N), shape of `velocity`."""
    return level(velocity, coulomb, static, stribeck_velocity) * np.sign(velocity) + viscous * velocity


def steady_slopes(velocity: Array, coulomb: float, static: float, stribeck_velocity: float) -> Array:
    """Derivatives of `steady` with respect to its four parameters in their order, shape (rows, 4)."""
    fade = level(velocity, 0.0, 1.0, stribeck_velocity)
    fading = 2.0 * (static - coulomb) * fade * velocity**2 / stribeck_velocity**3
    ways = np.sign(velocity)
    return np.column_stack([(1.0 - fade) * ways, fade * ways, fading * ways, velocity])
