"""Torque offset: a constant torque, or a zero error of the current sensor."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


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

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=np.full(len(motion), values["offset"]))

    def untestable(self, motion: Motion) -> str | None:
        factor = motion.gravity_factor
        if factor is not None and motion.payload is not None and float(np.min(factor)) > 0.999:
            return "gravity acts on every row, so an offset cannot be told from it: add a run on its side"
        return None
