"""Nonlinear viscous friction: drag that grows with the square of speed."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


@final
class NonlinearViscous(Effect):
    name = "nonlinear_viscous"
    title = "Nonlinear viscous friction"
    follows = ("velocity",)
    formula = "c |w| w"
    reveals = "a wide range of speeds"
    look_alikes = ("stribeck_shape",)
    citation = "Waiboer, Aarts & Jonker 2005 (lubricated joints); Bittencourt & Gunnarsson 2012"
    parameters = (EffectParameter("quadratic", "quadratic_damping", "coefficient c"),)
    coordinates = (Coordinate("quadratic"),)

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=values["quadratic"] * np.abs(motion.velocity) * motion.velocity)
