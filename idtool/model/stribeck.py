"""The static friction curve (paper Eq. 9)."""

from __future__ import annotations

from typing import overload

import numpy as np

from idtool.model.motion import Array

#: The paper's exponent; the effect `stribeck_shape` frees it.
EXPONENT = 2.0


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
    fade = np.exp(-((np.abs(velocity) / stribeck_velocity) ** exponent))
    return coulomb + (static - coulomb) * fade


def steady(velocity: Array, coulomb: float, static: float, stribeck_velocity: float, viscous: float) -> Array:
    """Steady friction torque g(w) sgn(w) + viscous w, N m (N), shape of `velocity`."""
    return level(velocity, coulomb, static, stribeck_velocity) * np.sign(velocity) + viscous * velocity
