"""Direction asymmetry: viscous friction that differs between the directions."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


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

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=values["asymmetry"] * np.abs(motion.velocity))
