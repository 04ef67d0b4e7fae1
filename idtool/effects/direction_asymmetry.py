"""Direction asymmetry: viscous friction that differs between the directions."""

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
    total[TORQUE] += n[0] * np.abs(row.velocity)


@final
class DirectionAsymmetry(Effect):
    name = "direction_asymmetry"
    title = "Direction asymmetry"
    follows = ("velocity", "direction")
    formula = "c |w|, that is a viscous coefficient sigma2 + c forwards and sigma2 - c backwards"
    reveals = "both directions at several speeds"
    look_alikes = ("torque_offset",)
    citation = "Janot, Gautier & Brunot 2019 (EMPS); Armstrong-Helouvry et al. 1994"
    parameters = (EffectParameter("asymmetry", "damping", "half the difference of the viscous coefficients"),)
    coordinates = (Coordinate("asymmetry"),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["asymmetry"],)

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->torque += asymmetry * fabsf(row->velocity);", values)
