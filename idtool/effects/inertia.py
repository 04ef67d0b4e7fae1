"""Inertia: torque in proportion to acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, varies
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    total[TORQUE] += n[0] * row.acceleration
    if len(n) > 1:
        total[TORQUE] += n[1] * row.payload * row.acceleration


@final
@dataclass(frozen=True)
class Inertia(Effect):
    """Of the axis alone, or of what it carries too: a payload on a lever r adds r^2 per kg.

    Attributes:
        loaded: whether the payload has a share of its own.
    """

    loaded: bool = False

    name = "inertia"
    title = "Inertia"
    follows = ("acceleration",)
    formula = "(J + m J_m) a, m the payload, J_m only where the data ask for it"
    reveals = "sines of rising frequency; the same with another payload"
    look_alikes = ("transport_delay", "compliance")
    citation = "Newton's second law; Gautier & Khalil 1990 for its identification"
    parameters = (
        EffectParameter("inertia", "inertia", "inertia J at the shaft of the torque constant", 0.0),
        EffectParameter(
            "per_payload", "inertia_per_payload", "what a kilogram of payload adds, J_m", 0.0, optional=True
        ),
    )
    coordinates = (
        Coordinate("inertia", lower=0.0, upper=math.inf),
        Coordinate("per_payload", lower=0.0, upper=math.inf),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        more = (values["per_payload"],) if "per_payload" in values else ()
        return values["inertia"], *more

    def in_c(self, values: Values) -> CForm:
        whole = "(inertia + per_payload * row->payload)" if "per_payload" in values else "inertia"
        return CForm(f"sum->torque += {whole} * row->acceleration;", values)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        return self.coordinates if self.loaded else self.coordinates[:1]

    def larger(self, motion: Motion) -> tuple[Effect, ...]:
        several = motion.payload is not None and varies(motion.payload, 1e-6)
        return (Inertia(loaded=True),) if several and not self.loaded else ()

    def form_of(self, values: Values) -> Effect:
        return Inertia("per_payload" in values)
