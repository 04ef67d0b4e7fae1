"""Stribeck shape: the fall of friction at low speed is steeper or flatter than a Gaussian."""

from __future__ import annotations

from typing import final

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import EXPONENT_CHANGE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row
from idtool.model.stribeck import EXPONENT

#: Exponents to start from besides: a fall that is nearly an exponential, and one that is nearly a step.
_TRIED = (1.0, 4.0)


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[EXPONENT_CHANGE] += n[0] - EXPONENT


@final
class StribeckShape(Effect):
    name = "stribeck_shape"
    title = "Stribeck shape"
    follows = ("velocity",)
    of_sliding = True
    formula = "exponent delta of exp(-|w / w_s|^delta), 2 in the paper"
    reveals = "many low speeds, closely spaced"
    look_alikes = ("nonlinear_viscous",)
    citation = "Bo & Pavelescu 1982; Armstrong-Helouvry 1991"
    parameters = (EffectParameter("exponent", "number", "delta", 0.3, 6.0),)
    #: A fit may end beyond what can be, by its error.
    coordinates = (Coordinate("exponent", null=EXPONENT, lower=0.15, upper=12.0, increment=1e-3),)

    at = staticmethod(at)

    def sizes(self, motion: Motion) -> list[dict[str, float]]:
        return [{"exponent": exponent} for exponent in _TRIED]

    def numbers(self, values: Values) -> tuple[float, ...]:
        return (values["exponent"],)

    def in_c(self, values: Values) -> CForm:
        return CForm("sum->exponent_change += change;", {"change": values["exponent"] - EXPONENT})
