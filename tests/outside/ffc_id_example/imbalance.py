"""An eccentric mass on the shaft: it pulls once per turn."""

from typing import final

import numpy as np

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion


@final
class Imbalance(Effect):
    name = "imbalance"
    title = "Imbalance"
    follows = ("position",)
    formula = "a sin(q) + b cos(q)"
    reveals = "a slow sweep over a whole turn"
    look_alikes = ("position_stiffness", "position_ripple")
    citation = "any text on rotating machinery"
    page = "https://example.org/imbalance"
    parameters = (
        EffectParameter("sine", "torque", "part that pulls most at a quarter turn"),
        EffectParameter("cosine", "torque", "part that pulls most at zero"),
    )
    coordinates = (Coordinate("sine"), Coordinate("cosine"))

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        q = motion.position
        return Contribution(torque=values["sine"] * np.sin(q) + values["cosine"] * np.cos(q))

    def in_c(self, values: Values) -> CForm:
        code = """
            float s, c;
            sine_and_cosine(row->position, &s, &c);
            sum->torque += sine * s + cosine * c;
        """
        return CForm(code, values)

    def untestable(self, motion: Motion) -> str | None:
        return "the axis moved less than a quarter turn" if np.ptp(motion.position) < np.pi / 2 else None
