"""At which level an axis slides whose friction is carried by elements that slip."""

from __future__ import annotations

from dataclasses import replace

from idtool.fit.joint import JointFit, solve

#: Of the friction elements carry so much at most: what is left shows at which level the axis slides.
_CARRIED = 0.98
#: Evaluations for the fit at that level: stiction, of which so little is left, goes far and slowly.
_SPENT = 200


def told_by_its_level(fit: JointFit) -> JointFit:
    """The fit with the level of sliding as its Coulomb level.

    Elements that carry more of the friction than there is are that level themselves, and a Coulomb level
    below theirs is none: any does as well.
    """
    element = next((one for one in fit.model.spec.effects if one.name == "hysteresis"), None)
    if element is None:
        return fit
    carried, _ = element.holds(fit.model.effect_values(fit.x, element))
    if carried <= _CARRIED * fit.values["coulomb"]:
        return fit
    yields = [name for name in fit.model.names if name.startswith("hysteresis.yield")]
    values = {**fit.values, **{name: _CARRIED * fit.values[name] for name in yields}, "coulomb": carried}
    if "static" in values:
        values["static"] = max(values["static"], carried)
    x = fit.model.coordinates({name: values[name] for name in fit.model.names})
    told = solve(fit.model, x, bend=fit.bend, most=_SPENT, held=frozenset(yields))
    return replace(told, held=frozenset())
