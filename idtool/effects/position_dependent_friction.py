"""Position-dependent friction: the friction level changes along the stroke (wire tension, wear)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.polynomial.chebyshev import chebval

from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values, stroke_of
from idtool.model.chebyshev import PLACE_IN_C, add_bends, bends_in_c, degree_of, place
from idtool.model.contribution import LEVEL_CHANGE
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.row import Row

#: Degrees of the polynomial over the stroke that are tried, the plainest first.
_DEGREES = (2, 4, 8)
#: So many times its mean friction may rise towards an end; below nothing it cannot fall, whatever this says.
_MOST = 3.0
#: Places on the stroke among which the highest and the lowest friction are sought.
_PLACES = 201


@jit()
def at(row: Row, n: Array, memory: Array, total: Array) -> None:
    x = place(row.position, n[0], n[1])
    total[LEVEL_CHANGE] += n[2] * x
    add_bends(total, LEVEL_CHANGE, x, n, 3)


@final
@dataclass(frozen=True)
class PositionDependentFriction(Effect):
    """The shape is a sum of Chebyshev polynomials in x, which is -1 and 1 at the ends.

    Attributes:
        degree: of the highest one.
    """

    degree: int = 2

    name = "position_dependent_friction"
    title = "Position-dependent friction"
    follows = ("position",)
    formula = "g(w) (1 + sum over k of s_k T_k(x)), x = (q - centre) / half stroke, held at the ends"
    reveals = "the same speed at different places"
    look_alikes = ("position_stiffness", "position_ripple")
    citation = "Armstrong-Helouvry et al. 1994, section 3"
    parameters = (
        EffectParameter("slope_1", "number", "relative change from the centre to an end", -_MOST, _MOST),
        EffectParameter("slope_2", "number", "relative change, curved part T_2", -_MOST, _MOST),
        *(
            EffectParameter(
                f"slope_{k}", "number", f"relative change, part T_{k}", -_MOST, _MOST, optional=True
            )
            for k in range(3, _DEGREES[-1] + 1)
        ),
        EffectParameter("center", "position", "middle of the stroke that was moved"),
        EffectParameter("half_stroke", "position", "half of it", 0.0),
    )
    coordinates = tuple(
        Coordinate(f"slope_{k}", lower=-_MOST, upper=_MOST, increment=1e-2)
        for k in range(1, _DEGREES[-1] + 1)
    )

    at = staticmethod(at)

    def numbers(self, values: Values) -> tuple[float, ...]:
        slopes = (values[f"slope_{k}"] for k in range(1, _degree(values) + 1))
        return values["center"], values["half_stroke"], *slopes

    def in_c(self, values: Values) -> CForm:
        bends = bends_in_c("level_change", "slope_", _degree(values))
        return CForm("\n".join([PLACE_IN_C, "sum->level_change += slope_1 * x;", *bends]), values)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        return self.coordinates[: self.degree]

    def together(self, values: Values) -> tuple[str, float] | None:
        x = np.linspace(-1.0, 1.0, _PLACES)
        slopes = [values[f"slope_{k}"] for k in range(1, _degree(values) + 1)]
        return "change of the friction over the stroke, peak to peak", float(
            np.ptp(chebval(x, [0.0, *slopes]))
        )

    def form_of(self, values: Values) -> Effect:
        return PositionDependentFriction(_degree(values))

    def larger(self, motion: Motion) -> tuple[Effect, ...]:
        return tuple(PositionDependentFriction(degree) for degree in _DEGREES if degree > self.degree)[:1]

    def constants(self, motion: Motion) -> dict[str, float]:
        return stroke_of(motion)


def _degree(values: Values) -> int:
    return degree_of(values, "slope_", _DEGREES[-1])
