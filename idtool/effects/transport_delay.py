"""Transport delay: position and velocity are reported later than the current."""

from __future__ import annotations

from typing import final

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


@final
class TransportDelay(Effect):
    name = "transport_delay"
    title = "Transport delay"
    follows = ("acceleration",)
    formula = "torque of time t computed from the position and velocity reported at t + d"
    reveals = "sines of rising frequency"
    look_alikes = ("inertia", "compliance")
    citation = "Ljung 1999, chapter 4"
    parameters = (EffectParameter("delay", "time", "how much later the motion is reported", -0.05, 0.05),)
    coordinates = (Coordinate("delay", lower=-0.05, upper=0.05, increment=1e-4),)

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(delay=values["delay"])
