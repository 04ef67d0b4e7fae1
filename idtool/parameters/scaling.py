"""A parameter file in N m from one in A or V (or in another constant's N m)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from idtool.effects import registry
from idtool.errors import InputError
from idtool.model.units import SUFFIXES, EffortUnit
from idtool.parameters.axis import Axis
from idtool.parameters.contents import DYNAMIC, GRAVITY_MODELS, STATIC
from idtool.parameters.drive import dimensions
from idtool.parameters.parameter import Parameter
from idtool.parameters.parameters import Parameters


def in_torque(parameters: Parameters, constant: Parameter, unit: EffortUnit) -> Parameters:
    """The file in N m (N), every standard error with that of the constant.

    Args:
        parameters: in A or V, or in N m by another constant of the same unit.
        constant: N m/A or N m/V.
        unit: "current" or "voltage".

    Raises:
        InputError: the file is counted in something that the constant does not lead from.
    """
    axis = parameters.axis
    before = axis.torque_constant if unit == "current" else axis.voltage_constant
    if axis.effort != unit and not (axis.effort == "torque" and before):
        raise InputError(
            f"the parameter file counts in {axis.effort}, and the constant leads from {unit}",
            place="[axis]",
            remedy="calibrate with logs of the same quantity as those that were identified",
        )
    factor = constant.value / (1.0 if axis.effort == unit else float(before or 1.0))
    relative = 0.0 if constant.stderr is None else constant.stderr / constant.value

    def scaled(values: Mapping[str, Parameter], dimensions: Mapping[str, str]) -> dict[str, Parameter]:
        return {
            name: _scaled(one, factor, relative) if _is_torque(dimensions[name]) else one
            for name, one in values.items()
        }

    effects = []
    for entry in parameters.effects:
        known = {one.name: one.dimension for one in registry.get(entry.name).parameters}
        effects.append(replace(entry, parameters=scaled(entry.parameters, known)))
    drive = parameters.drive
    if drive is not None:
        held = {name: getattr(drive, name) for name in dimensions(drive.command)}
        there = {name: one for name, one in held.items() if one is not None}
        drive = replace(drive, **scaled(there, dimensions(drive.command)))  # type: ignore[arg-type]
    gravity = GRAVITY_MODELS[parameters.gravity_model] if parameters.gravity_model else {}
    return replace(
        parameters,
        axis=with_constant(axis, constant, unit),
        gravity=scaled(parameters.gravity, gravity),
        static=scaled(parameters.static, STATIC),
        dynamic=scaled(parameters.dynamic, DYNAMIC),
        effects=tuple(effects),
        drive=drive,
    )


def with_constant(axis: Axis, constant: Parameter, unit: EffortUnit) -> Axis:
    """The axis with an identified constant, and its interval beside it."""
    name = "torque_constant" if unit == "current" else "torque_per_volt"
    found = {"stderr": constant.stderr, "ci95": list(constant.ci95) if constant.ci95 else None}
    extra = {f"{name}_{key}": value for key, value in found.items() if value is not None}
    known = {"torque_constant": constant.value} if unit == "current" else {"torque_per_volt": constant.value}
    return replace(axis, effort="torque", extra={**axis.extra, **extra}, **known)  # type: ignore[arg-type]


def _is_torque(dimension: str) -> bool:
    suffix = SUFFIXES[dimension][0]
    return dimension.startswith("inertia") or suffix == "nm" or suffix.startswith("nm_")


def _scaled(one: Parameter, factor: float, relative: float) -> Parameter:
    """In proportion; the errors of the number and of the factor are taken for independent."""
    value = one.value * factor
    more = abs(value) * relative
    if one.stderr is None:
        limits = (None if end is None else end * factor for end in (one.at_least, one.at_most))
        return replace(one, value=value) if one.known else replace(one, value=value).undetermined(*limits)
    stderr = math.hypot(one.stderr * factor, more)
    if one.ci95 is None:
        return replace(one, value=value, stderr=stderr)
    low, high = (bound * factor for bound in one.ci95)
    widened = (value - math.hypot(value - low, 1.96 * more), value + math.hypot(high - value, 1.96 * more))
    return replace(one, value=value, stderr=stderr, ci95=widened)
