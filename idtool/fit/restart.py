"""Look for a better minimum of the friction curve, from other shapes of it."""

from __future__ import annotations

import math

from idtool.fit.joint import JointFit, kept, solve
from idtool.model.stribeck import level

#: Static over Coulomb level of the curves from which to start: a rising and a falling one.
_RATIOS = (0.6, 1.5)
#: ... where the curve may only fall: a little and much.
_FALLING = (1.1, 1.7)
#: Evaluations that screen a start.
_SCREEN = 6
#: A start that is not within this factor of the best sum of squares after them is not finished.
_CLOSE = 1.3
#: A minimum is a better one if its sum of squares is below this share of the best.
_BETTER = 0.998
#: Share of the sum of squares that does not decide whether a minimum is better.
_NEAR = 1e-4
#: A rise is told from viscous friction where a third of the speeds is beyond it, that is beyond two
#: Stribeck velocities.
_SEEN_LEVEL = 3.0
#: A residual this close to the sensor noise is hardly worth a look for a better minimum.
_AT_NOISE = 1.05


def rises(fit: JointFit) -> bool:
    """Whether the friction curve rises from rest."""
    return fit.values.get("static", fit.values["coulomb"]) < fit.values["coulomb"]


def rises_all_along(fit: JointFit) -> bool:
    """Whether the friction curve rises over so many speeds that it is viscous friction by another name."""
    return rises(fit) and _SEEN_LEVEL * fit.values["stribeck_velocity"] > fit.model.scales.speed


def worth_a_restart(fit: JointFit) -> bool:
    """Whether the residual stands out of the sensor noise, so that a better minimum could show."""
    return fit.rmse >= _AT_NOISE * fit.model.filtered_noise


@kept
def restart(fit: JointFit) -> JointFit:
    """The best of `fit` and of fits started from a falling and a rising, a narrow and a wide curve.

    A model that lacked an effect can have bent its friction curve to make up for it, and stays bent
    when the effect is added. The starts share everything but the curve with `fit`; the few evaluations
    that screen them are cheap, and only one that gets close is finished.
    """
    model = fit.model
    if "static" not in model.names:
        return fit
    best = fit
    # a static level that is gone at the slowest speed seen says nothing of the curve
    friction = model.friction(fit.x)
    slow = float(level(model.scales.slowest, friction.coulomb, friction.static, friction.stribeck_velocity))
    speeds = (1.5 * model.scales.slowest, math.sqrt(model.scales.slowest * model.scales.speed))
    for ratio in _FALLING if model.spec.falling else _RATIOS:
        for speed in speeds:
            values = dict(fit.values)
            moving = max(values["coulomb"], 0.3 * slow)
            values |= {"coulomb": moving, "static": ratio * moving, "stribeck_velocity": speed}
            found = solve(model, model.coordinates(values), bend=fit.bend, most=_SCREEN)
            if found.sse < _CLOSE * best.sse:
                found = solve(model, found.x, bend=fit.bend, tolerance=_NEAR)
            if found.sse < _BETTER * best.sse:
                best = found
    return best
