"""What physics rules out in a parameter file, said with the key and what was expected."""

from __future__ import annotations

import math
from collections.abc import Mapping

from idtool.errors import InputError
from idtool.model.units import Units, file_key
from idtool.parameters.parameter import ROUNDING, Parameter


def positive(
    values: dict[str, Parameter], dimensions: Mapping[str, str], place: str, kind: Units
) -> dict[str, Parameter]:
    for name, parameter in values.items():
        zero_allowed = name in ("viscous", "bristle_damping", "coulomb", "static")
        if parameter.value < 0 or (parameter.value == 0 and not zero_allowed):
            key = file_key(name, dimensions[name], kind)
            raise InputError(
                f"expected a number {'>= 0' if zero_allowed else '> 0'}, found {parameter.value:g}",
                place=f"{place}.{key}.value",
                remedy="correct it, or fit it again",
            )
    return values


def some_friction(static: dict[str, Parameter], dynamic: dict[str, Parameter], kind: Units) -> None:
    """A bristle needs a level that limits its deflection: LuGre divides by it."""
    if dynamic and static and static["coulomb"].value == 0 and static["static"].value == 0:
        raise InputError(
            "both levels of the friction are 0, against which no bristle is deflected",
            place=f"friction.static.{file_key('coulomb', 'torque', kind)}.value",
            remedy="expected a number > 0, or no [friction.dynamic]",
        )


def within_bounds(name: str, values: Mapping[str, Parameter], place: str, kind: Units) -> None:
    """Refuse what the effect's physics rules out; an estimate may lie where the fit may look for it."""
    from idtool.effects import registry  # it knows every effect; imported late to keep reading light

    effect = registry.get(name)
    searched = {one.name: one for one in effect.coordinates}
    for parameter in effect.parameters:
        if parameter.name not in values:
            continue
        number = values[parameter.name].value
        lower, upper = parameter.lower, parameter.upper
        if one := searched.get(parameter.name):
            lower, upper = min(lower, one.lower), max(upper, one.upper)
        slack = ROUNDING * (1.0 + abs(number))
        if not lower - slack <= number <= upper + slack:
            wanted = f">= {lower:g}" if math.isinf(upper) else f"from {lower:g} to {upper:g}"
            key = file_key(parameter.name, parameter.dimension, kind)
            raise InputError(
                f"expected a number {wanted} ({parameter.meaning}), found {number:g}",
                place=f"{place}.{key}.value",
                remedy="correct it, or fit it again",
            )
