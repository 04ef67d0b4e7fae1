"""Nonlinear viscous friction: drag that grows with the square of speed."""

from __future__ import annotations

import math
from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: Share of the rows that are no faster than what counts as the fastest speed: one bad row is not.
_MOST_ROWS = 0.999


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[TORQUE] += n[0] * np.minimum(np.abs(row.velocity), n[1]) * row.velocity


@final
class NonlinearViscous(Effect):
    name = "nonlinear_viscous"
    title = "Nonlinear viscous friction"
    follows = ("velocity",)
    of_sliding = True
    formula = "c |w| w; beyond the fastest speed that was moved w_m, c w_m w"
    reveals = "a wide range of speeds"
    look_alikes = ("stribeck_shape",)
    citation = "Waiboer, Aarts & Jonker 2005 (lubricated joints); Bittencourt & Gunnarsson 2012"
    parameters = (
        EffectParameter("quadratic", "quadratic_damping", "coefficient c"),
        # a parabola that was seen over a part of the speeds would outgrow any friction beyond them
        EffectParameter(
            "fastest",
            "velocity",
            "fastest speed w_m that was moved; any, where not given",
            0.0,
            optional=True,
        ),
    )
    coordinates = (Coordinate("quadratic"),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return values["quadratic"], values.get("fastest", math.inf)

    def in_c(self, values: Values) -> CForm:
        speed = "fminf(fabsf(row->velocity), fastest)" if "fastest" in values else "fabsf(row->velocity)"
        return CForm(f"sum->torque += quadratic * {speed} * row->velocity;", values)

    def constants(self, motion: Motion) -> dict[str, float]:
        return {"fastest": float(np.quantile(np.abs(motion.velocity), _MOST_ROWS))}
