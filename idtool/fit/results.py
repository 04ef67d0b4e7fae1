"""From a joint fit to the parameters of the file: values, errors, intervals and flags."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from idtool.effects.base import Effect
from idtool.fit.identifiability import undetermined
from idtool.fit.joint import JointFit
from idtool.fit.vague import standard_error
from idtool.model.motion import Array
from idtool.parameters import DYNAMIC, GRAVITY_MODELS, STATIC, EffectEntry, Parameter


def static_parameters(fit: JointFit) -> dict[str, Parameter]:
    """The four of `[friction.static]`; those that the friction law lacks are marked not identified."""
    friction = fit.model.friction(fit.x)
    found = {name: _one(fit, name, name != "viscous") for name in STATIC if name in fit.model.names}
    found = _doubting("static", found, fit)
    return {name: found.get(name) or Parameter(getattr(friction, name), identified=False) for name in STATIC}


def dynamic_parameters(fit: JointFit) -> dict[str, Parameter]:
    """The two of `[friction.dynamic]`."""
    friction = fit.model.friction(fit.x)
    if fit.model.spec.friction != "lugre":
        return {name: Parameter(getattr(friction, name), at_bound=True, identified=False) for name in DYNAMIC}
    found = {
        "bristle_stiffness": _one(fit, "bristle_stiffness", True),
        "bristle_damping": _one(fit, "bristle_damping", False),
    }
    return _doubting("dynamic", found, fit)


def gravity_parameters(fit: JointFit) -> dict[str, Parameter]:
    """The two of `[gravity]`; one that the data cannot show is 0 and marked not identified."""
    spec = fit.model.spec
    if spec.gravity is None:
        return {}
    found = {
        name: _one(fit, f"gravity.{name}", False)
        if name in spec.gravity_columns
        else Parameter(0.0, identified=False)
        for name in GRAVITY_MODELS[spec.gravity]
    }
    return _doubting("gravity", found, fit)


def effect_entries(fit: JointFit) -> tuple[EffectEntry, ...]:
    """Every effect with its parameters."""
    return tuple(effect_entry(fit, effect) for effect in fit.model.spec.effects)


def effect_entry(fit: JointFit, effect: Effect) -> EffectEntry:
    """An effect's file parameters; their errors follow from the coordinates' by linearisation."""
    prefix = f"{effect.name}."
    mine = [i for i, name in enumerate(fit.model.names) if name.startswith(prefix)]
    values = fit.model.effect_values(fit.x, effect)
    kind = fit.model.recording.axis.units
    centre = effect.to_file(values, kind)
    gradient: dict[str, Array] = {name: np.zeros(len(mine)) for name in centre}
    for place, i in enumerate(mine):
        coordinate = fit.model.names[i].removeprefix(prefix)
        sd = math.sqrt(max(fit.covariance[i, i], 0.0))
        increment = 1e-3 * sd if sd > 0 else 1e-6
        moved = effect.to_file({**values, coordinate: values[coordinate] + increment}, kind)
        for name in centre:
            change = moved[name] - centre[name]
            if abs(change) > math.pi and "phase" in name:
                change -= math.copysign(2.0 * math.pi, change)
            gradient[name][place] = change / increment
    covariance = fit.covariance[np.ix_(mine, mine)]
    at_bound = any(fit.at_bound[fit.model.names[i]] for i in mine)
    quantile = float(max((fit.quantile[i] for i in mine), default=0.0))
    limits = undetermined(fit).get(f"effects.{effect.name}")
    ends: list[dict[str, float]] = [{}, {}]
    if limits is not None and len(mine) == 1:  # of several, the limit of one is none of what they make
        coordinate = fit.model.names[mine[0]].removeprefix(prefix)
        ends = [
            effect.to_file({**values, coordinate: end}, kind) if end is not None else {} for end in limits
        ]
    entries: dict[str, Parameter] = {}
    for name, value in centre.items():
        sd = float(np.sqrt(max(float(gradient[name] @ covariance @ gradient[name]), 0.0)))
        half = quantile * sd
        if not gradient[name].any():
            entries[name] = Parameter(value)
        elif at_bound or limits is not None:
            found = Parameter(value, at_bound=at_bound)
            entries[name] = found.undetermined(*(end.get(name) for end in ends))
        else:
            entries[name] = Parameter(value, sd, (value - half, value + half))
    return EffectEntry(effect.name, entries)


def _one(fit: JointFit, name: str, logarithmic: bool) -> Parameter:
    i = fit.model.names.index(name)
    sd = standard_error(fit, name)
    value = fit.values[name]
    if fit.at_bound[name]:
        return Parameter(value, at_bound=True).undetermined()
    half = float(fit.quantile[i]) * sd
    if logarithmic:
        reach = math.exp(min(half, 50.0))
        stderr, interval = value * sd, (value / reach, value * reach)
    else:
        stderr, interval = sd, (value - half, value + half)
    return Parameter(value, stderr, interval)


def _doubting(part: str, found: dict[str, Parameter], fit: JointFit) -> dict[str, Parameter]:
    """The parameters of a part, a bound in place of the interval of those that the data do not determine."""
    lacking = undetermined(fit)
    return {
        name: parameter.undetermined(*lacking[f"{part}.{name}"]) if f"{part}.{name}" in lacking else parameter
        for name, parameter in found.items()
    }


def passivity(static: Mapping[str, Parameter], dynamic: Mapping[str, Parameter]) -> str | None:
    """A sentence if the friction model can give energy back (Barabanov & Ortega 2000), else None; nothing is
    said of levels that are not determined."""
    if not (static["coulomb"].identified and static["static"].identified):
        return None
    coulomb, stick = static["coulomb"].value, static["static"].value
    if coulomb <= 0:
        return "the Coulomb level is zero, so the friction model is not passive."
    needed = dynamic["bristle_damping"].value * (stick - coulomb) / coulomb
    if static["viscous"].value <= needed:
        return (
            f"the model is not passive: viscous friction {static['viscous'].value:.3g} should exceed "
            f"sigma1 (tau_s - tau_c) / tau_c = {needed:.3g}; compensate less than all of it."
        )
    return None
