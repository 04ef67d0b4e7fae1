"""Torque-constant saturation: the motor gives less torque per ampere at high current."""

from __future__ import annotations

from typing import final

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


@final
class TorqueConstantSaturation(Effect):
    name = "torque_constant_saturation"
    title = "Torque-constant saturation"
    follows = ("load",)
    formula = "torque = K i (1 - kappa |i|)"
    reveals = "high payloads"
    look_alikes = ("load_dependent_friction", "drive_backdrive")
    citation = "Hendershot & Miller 2010, Design of Brushless Permanent-Magnet Machines"
    needs = ("torque_constant",)
    parameters = (EffectParameter("kappa", "per_current", "relative loss of torque per ampere"),)
    coordinates = (Coordinate("kappa", lower=-0.5, upper=0.5, increment=1e-4),)

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        assert motion.torque_constant is not None
        return Contribution(saturation=values["kappa"] / motion.torque_constant)
