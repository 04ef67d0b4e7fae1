"""Stribeck shape: the fall of friction at low speed is steeper or flatter than a Gaussian."""

from __future__ import annotations

from typing import final

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion
from idtool.model.stribeck import EXPONENT


@final
class StribeckShape(Effect):
    name = "stribeck_shape"
    title = "Stribeck shape"
    follows = ("velocity",)
    formula = "exponent delta of exp(-|w / w_s|^delta), 2 in the paper"
    reveals = "many low speeds, closely spaced"
    look_alikes = ("nonlinear_viscous",)
    citation = "Bo & Pavelescu 1982; Armstrong-Helouvry 1991"
    parameters = (EffectParameter("exponent", "number", "delta", 0.3, 6.0),)
    coordinates = (Coordinate("exponent", null=EXPONENT, lower=0.3, upper=6.0, increment=1e-3),)

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(exponent_change=values["exponent"] - EXPONENT)
