"""A smooth shape over the stroke that was moved: a sum of Chebyshev polynomials, compiled and in C."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba.extending import register_jitable

from idtool.model.motion import Array

#: The place on the stroke: -1 and 1 at its ends, and held there.
PLACE_IN_C = "const float x = clamp((row->position - center) * (1.0f / half_stroke), -1.0f, 1.0f);"


@register_jitable
def place(position: float, center: float, half_stroke: float) -> float:
    return np.minimum(np.maximum((position - center) / half_stroke, -1.0), 1.0)  # type: ignore[no-any-return]


@register_jitable
def add_bends(total: Array, field: int, x: float, n: Array, first: int) -> None:
    """The numbers from the first on times T_2, T_3, ... at `x`, onto a field of `total`."""
    before, now = 1.0, x
    for k in range(first, len(n)):
        before, now = now, 2.0 * x * now - before
        total[field] += n[k] * now


def bends_in_c(field: str, prefix: str, degree: int) -> list[str]:
    """The same in C, for parameters `prefix`2 to `prefix``degree`."""
    lines = ["float before = 1.0f, now = x, next;"]
    for k in range(2, degree + 1):
        lines.append("next = 2.0f * x * now - before; before = now; now = next;")
        lines.append(f"sum->{field} += {prefix}{k} * now;")
    return lines


def degree_of(values: Mapping[str, float], prefix: str, highest: int) -> int:
    """Of the highest polynomial that a file has a number for; 1 without bends."""
    return max((k for k in range(2, highest + 1) if f"{prefix}{k}" in values), default=1)
