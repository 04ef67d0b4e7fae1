"""Nonlinear viscous friction: drag that grows with the square of speed."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[TORQUE] += n[0] * np.abs(row.velocity) * row.velocity


@final
class NonlinearViscous(Effect):
    name = "nonlinear_viscous"
    title = "Nonlinear viscous friction"
    follows = ("velocity",)
    of_sliding = True
    formula = "c |w| w"
    reveals = "a wide range of speeds"
    look_alikes = ("stribeck_shape",)
    citation = "Waiboer, Aarts & Jonker 2005 (lubricated joints); Bittencourt & Gunnarsson 2012"
    parameters = (EffectParameter("quadratic", "quadratic_damping", "coefficient c"),)
    coordinates = (Coordinate("quadratic"),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["quadratic"],)

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->torque += quadratic * fabsf(row->velocity) * row->velocity;", values)
