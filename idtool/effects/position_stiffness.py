"""Position stiffness: a spring between the moving part and the frame (hose, cable, wire)."""

from __future__ import annotations

from typing import final

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


@final
class PositionStiffness(Effect):
    """Its neutral position holds any constant offset as well: the two cannot be told apart."""

    name = "position_stiffness"
    title = "Position stiffness"
    follows = ("position",)
    formula = "k (q - q0)"
    reveals = "slow moves over the whole stroke"
    look_alikes = ("torque_offset", "position_dependent_friction", "position_ripple")
    absorbs = ("torque_offset",)
    citation = "Hooke's law; cable and hose springs in Bittencourt et al. 2012"
    parameters = (
        EffectParameter("stiffness", "stiffness", "spring rate k"),
        EffectParameter("neutral", "position", "position q0 at which the spring is slack"),
    )
    coordinates = (Coordinate("stiffness"), Coordinate("pull"))

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=values["stiffness"] * motion.position + values["pull"])

    def to_parameters(self, values: Values) -> dict[str, float]:
        stiffness = values["stiffness"]
        return {"stiffness": stiffness, "neutral": -values["pull"] / stiffness if stiffness else 0.0}

    def to_values(self, parameters: Values) -> dict[str, float]:
        return {
            "stiffness": parameters["stiffness"],
            "pull": -parameters["stiffness"] * parameters["neutral"],
        }
