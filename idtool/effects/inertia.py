"""Inertia: torque in proportion to acceleration."""

from __future__ import annotations

import math
from typing import final

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[TORQUE] += n[0] * row.acceleration


@final
class Inertia(Effect):
    name = "inertia"
    title = "Inertia"
    follows = ("acceleration",)
    formula = "J a"
    reveals = "sines of rising frequency"
    look_alikes = ("transport_delay", "compliance")
    citation = "Newton's second law; Gautier & Khalil 1990 for its identification"
    parameters = (EffectParameter("inertia", "inertia", "inertia at the shaft of the torque constant", 0.0),)
    coordinates = (Coordinate("inertia", lower=0.0, upper=math.inf),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["inertia"],)

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->torque += inertia * row->acceleration;", values)
