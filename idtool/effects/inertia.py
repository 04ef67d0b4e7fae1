"""Inertia: torque in proportion to acceleration."""

from __future__ import annotations

import math
from typing import final

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


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

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=values["inertia"] * motion.acceleration)
