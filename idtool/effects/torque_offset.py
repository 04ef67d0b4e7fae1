"""Torque offset: a constant torque, or a zero error of the current sensor."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[TORQUE] += n[0]


@final
class TorqueOffset(Effect):
    """While the axis moves, Coulomb friction that differs between directions is the same thing."""

    name = "torque_offset"
    title = "Torque offset"
    follows = ("direction",)
    formula = "b"
    reveals = "constant speeds in both directions with gravity out of the way"
    look_alikes = ("direction_asymmetry", "position_stiffness", "tilt_misalignment")
    citation = "Armstrong-Helouvry, Dupont & Canudas de Wit 1994"
    parameters = (EffectParameter("offset", "torque", "constant torque"),)
    coordinates = (Coordinate("offset"),)

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["offset"],)

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->torque += offset;", values)

    def untestable(self, motion: Motion) -> str | None:
        factor = motion.gravity_factor
        if factor is not None and motion.payload is not None and float(np.min(factor)) > 0.999:
            return "gravity acts on every row, so an offset cannot be told from it: add a run on its side"
        return None
