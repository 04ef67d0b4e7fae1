"""Position-dependent friction: the friction level changes along the stroke (wire tension, wear)."""

from __future__ import annotations

from typing import final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


@final
class PositionDependentFriction(Effect):
    """The shape is a Chebyshev polynomial of degree 2 in x, which is -1 and 1 at the ends."""

    name = "position_dependent_friction"
    title = "Position-dependent friction"
    follows = ("position",)
    formula = "g(w) (1 + s1 x + s2 (2 x^2 - 1)), x = (q - centre) / half stroke, held at the ends"
    reveals = "the same speed at different places"
    look_alikes = ("position_stiffness", "position_ripple")
    citation = "Armstrong-Helouvry et al. 1994, section 3"
    parameters = (
        EffectParameter("slope_1", "number", "relative change from the centre to an end", -0.9, 0.9),
        EffectParameter("slope_2", "number", "relative change, curved part", -0.9, 0.9),
        EffectParameter("center", "position", "middle of the stroke that was moved"),
        EffectParameter("half_stroke", "position", "half of it", 0.0),
    )
    coordinates = (
        Coordinate("slope_1", lower=-0.9, upper=0.9, increment=1e-2),
        Coordinate("slope_2", lower=-0.9, upper=0.9, increment=1e-2),
    )

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        x = np.clip((motion.position - values["center"]) / values["half_stroke"], -1.0, 1.0)
        return Contribution(level_change=values["slope_1"] * x + values["slope_2"] * (2.0 * x * x - 1.0))

    def constants(self, motion: Motion) -> dict[str, float]:
        low, high = float(np.min(motion.position)), float(np.max(motion.position))
        return {"center": 0.5 * (low + high), "half_stroke": 0.5 * (high - low)}
