"""Position stiffness: a spring between the moving part and the frame (hose, cable, wire)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, stroke_of
from idtool.model.chebyshev import PLACE_IN_C, add_bends, bends_in_c, degree_of, place
from idtool.model.contribution import TORQUE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: Degrees of the shape; cables and hoses are no straight lines.
_DEGREES = (1, 3, 5)
HIGHEST_DEGREE = _DEGREES[-1]


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    stiffness, pull = n[0], n[1]
    total[TORQUE] += stiffness * row.position + pull
    if len(n) > 2:
        add_bends(total, TORQUE, place(row.position, n[2], n[3]), n, 4)


@final
@dataclass(frozen=True)
class PositionStiffness(Effect):
    """A straight line, or a polynomial where the data ask for it; outside the stroke the line goes on.

    Its neutral position holds any constant offset as well: the two cannot be told apart.

    Attributes:
        degree: of the polynomial.
    """

    degree: int = 1

    name = "position_stiffness"
    title = "Position stiffness"
    follows = ("position",)
    formula = (
        "k (q - q0) + sum over k = 2, ... of c_k T_k(x), x = (q - centre) / half stroke, held at the ends"
    )
    reveals = "slow moves over the whole stroke"
    look_alikes = ("torque_offset", "position_dependent_friction", "position_ripple")
    absorbs = ("torque_offset",)
    citation = "Hooke's law; cable and hose springs in Bittencourt et al. 2012; Chebyshev polynomials T_k"
    parameters = (
        EffectParameter("stiffness", "stiffness", "spring rate k"),
        EffectParameter("neutral", "position", "position q0 at which the straight spring is slack"),
        *(
            EffectParameter(f"shape_{k}", "torque", f"coefficient of T_{k}", optional=True)
            for k in range(2, HIGHEST_DEGREE + 1)
        ),
        EffectParameter("center", "position", "middle of the stroke that was moved", optional=True),
        EffectParameter("half_stroke", "position", "half of it", 0.0, optional=True),
    )
    coordinates = (
        Coordinate("stiffness"),
        Coordinate("pull"),
        *(Coordinate(f"shape_{k}") for k in range(2, HIGHEST_DEGREE + 1)),
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        straight = values["stiffness"], values["pull"]
        if "shape_2" not in values:
            return straight
        shape = (values[f"shape_{k}"] for k in range(2, _degree(values) + 1))
        return *straight, values["center"], values["half_stroke"], *shape

    def in_c(self, values: Values) -> CForm:
        lines = ["sum->torque += stiffness * row->position + pull;"]
        if "shape_2" in values:
            lines += [PLACE_IN_C, *bends_in_c("torque", "shape_", _degree(values))]
        return CForm("\n".join(lines), values)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        return self.coordinates[: self.degree + 1]

    def form_of(self, values: Values) -> Effect:
        return PositionStiffness(_degree(values))

    def larger(self, motion: Motion) -> tuple[Effect, ...]:
        return tuple(PositionStiffness(degree) for degree in _DEGREES if degree > self.degree)[:1]

    def constants(self, motion: Motion) -> dict[str, float]:
        return stroke_of(motion)

    def to_parameters(self, values: Values) -> dict[str, float]:
        stiffness = values["stiffness"]
        result = {"stiffness": stiffness, "neutral": -values["pull"] / stiffness if stiffness else 0.0}
        kept = [f"shape_{k}" for k in range(2, _degree(values) + 1)]
        return result | {name: values[name] for name in ([*kept, "center", "half_stroke"] if kept else [])}

    def to_values(self, parameters: Values) -> dict[str, float]:
        kept = {name: value for name, value in parameters.items() if name != "neutral"}
        return kept | {"pull": -parameters["stiffness"] * parameters["neutral"]}


def _degree(values: Values) -> int:
    return degree_of(values, "shape_", HIGHEST_DEGREE)
