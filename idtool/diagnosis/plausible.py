"""Whether a fitted effect can be there: by its numbers, by its size, by the rows that show it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from idtool.diagnosis.evidence import chance_of
from idtool.diagnosis.shapes import Unnamed
from idtool.diagnosis.sliding import SETTLED, since_turn
from idtool.effects.base import Effect
from idtool.effects.hysteresis import reaches
from idtool.effects.torque_constant_saturation import per_torque
from idtool.fit.identifiability import brief, stribeck_seen
from idtool.fit.joint import JointFit, added_by, torque_of
from idtool.fit.left_out import SURELY, left_out_error
from idtool.model.motion import since_reversal

#: What is less than this share of the torque that is no gravity does not matter, named or not.
WORTH = 0.01
#: ... and one that is in is nothing any more below this share of it.
_NOTHING = 0.2 * WORTH
#: What is said of an effect that is in has to be as sure as every effect: a chance of 0.01 in a library of
#: twenty.
CHANCE = 5e-4
#: A line that bends to another one takes two points on each side.
_IN_BEND = 4.0


def impossible(fit: JointFit, effect: Effect) -> str | None:
    """Why the fitted values cannot be that effect, as a sentence; None if they can."""
    if effect.told_by_turns and not _shows_turns(fit):
        return "only turns tell it from friction under load and another gravity, and no presliding is seen"
    own = (name for name in fit.model.names if name.startswith(f"{effect.name}."))
    names = {other.name for other in fit.model.spec.effects}
    if not isinstance(effect, Unnamed) and any(fit.at_bound[name] for name in own):
        return "its parameter ran to a bound"
    values = fit.model.effect_values(fit.x, effect)
    if reason := effect.implausible(values, fit.values) or _beyond_physics(fit, effect, values):
        return reason
    if reason := _unseen_in_turns(fit, effect):
        return reason
    if effect.name == "torque_constant_saturation" and _falls(fit, values):
        return "more current would make less torque"
    if effect.name == "stribeck_shape" and not stribeck_seen(fit):
        return "no stiction shows apart from the Coulomb level, so the fall between them has no shape"
    if "direction" in effect.follows and "velocity" in effect.follows and _drives(fit, effect):
        return "friction would drive the axis one way"
    if effect.of_sliding and "hysteresis" in names and not _shows_in_sliding(fit, effect):
        return "it does not show where the axis slides steadily, and its presliding is none of LuGre's"
    if effect.name != "inertia" and not worth_it(fit, effect, _NOTHING):
        return "next to nothing of it is left"
    # what accelerates a drive that friction hardly brakes may be any multiple of what is left for it
    if effect.name != "inertia" and torque_of(fit, effect) > fit.model.recording.torque_size:
        return "it would be larger than the torque that was measured, and something else would cancel it"
    return None


def worth_it(fit: JointFit, effect: Effect, share: float = WORTH) -> bool:
    """Whether an effect is more than this share of the friction."""
    return torque_of(fit, effect) > share * fit.model.friction_sizes[0]


def worth_beside(larger: JointFit, smaller: JointFit) -> bool:
    """Whether what the larger of two models adds to the smaller is more than that share of the friction, or
    left-out trials surely ask for it: a weight that makes up for the most of it is off by more than that."""
    gained = float(np.mean(smaller.residual**2) - np.mean(larger.residual**2))
    if gained > (WORTH * larger.model.friction_sizes[0]) ** 2:
        return True
    return left_out_error(smaller) > SURELY * left_out_error(larger)


def _beyond_physics(fit: JointFit, effect: Effect, values: Mapping[str, float]) -> str | None:
    """Which number of an effect has a value that it cannot have, by more than its error; None if none has.
    The fit lets some pass such a limit (a friction per load below zero), so that zero is no bound."""
    for p in effect.parameters:
        beyond = max(p.lower - values[p.name], values[p.name] - p.upper) if p.name in values else 0.0
        name = f"{effect.name}.{p.name}"
        if beyond > 0.0 and name in fit.model.names:
            i = fit.model.names.index(name)
            if beyond > fit.quantile[i] * np.sqrt(fit.covariance[i, i]):
                return f"its {p.name.replace('_', ' ')} would be {values[p.name]:.2g}, which cannot be"
    return None


def _falls(fit: JointFit, values: Mapping[str, float]) -> bool:
    """Whether K i (1 - kappa |i|) falls again below the largest current of the logs."""
    recording = fit.model.recording
    loss = per_torque(values, recording.motion.torque_constant)
    return bool(2.0 * loss * np.max(np.abs(recording.torque)) > 1.0)


def _shows_turns(fit: JointFit) -> bool:
    """Whether the rows show what happens after a turn."""
    return fit.model.spec.friction == "lugre" and brief(fit) is None


def _drives(fit: JointFit, effect: Effect) -> bool:
    """Whether friction, with an effect that makes it differ between the directions, gives power to the axis
    in one of them: it takes some, whichever way the axis moves."""
    recording, friction = fit.model.recording, fit.model.friction(fit.x)
    speed = recording.motion.velocity
    torque = friction.coulomb * np.sign(speed) + friction.viscous * speed + added_by(fit, effect)
    return any(float(torque[way] @ speed[way]) < 0.0 for way in (speed > 0.0, speed < 0.0))


def _shows_in_sliding(fit: JointFit, effect: Effect) -> bool:
    """Whether rows on which the bristle has forgotten the last reversal show an effect too. Where the
    presliding is none of LuGre's, what the model leaves after each reversal bends the curve of sliding."""
    friction = fit.model.friction(fit.x)
    (element,) = (e for e in fit.model.spec.effects if e.name == "hysteresis")
    values = fit.model.effect_values(fit.x, element)
    own = max(friction.coulomb, friction.static) - element.holds(values)[0]
    # the element slips on when it has turned round, a reach back and one on
    settled = since_turn(fit) > max(SETTLED * own / friction.bristle_stiffness, 2.0 * max(reaches(values)))
    return bool(settled.any()) and chance_of(fit, effect, settled) < CHANCE


def _unseen_in_turns(fit: JointFit, effect: Effect) -> str | None:
    """Why the presliding of a slip element is none that the rows show; None if it is, or has none."""
    if effect.name != "hysteresis":
        return None
    motion = fit.model.recording.motion
    reach = min(reaches(fit.model.effect_values(fit.x, effect)))
    bending = since_reversal(motion.position, motion.velocity, motion.trial) <= reach
    rows = float(np.count_nonzero(bending & fit.model.recording.usable)) / motion.reversals
    if rows >= _IN_BEND:
        return None
    return f"it would bend over {rows:.1f} rows after a turn: too few to tell its presliding from LuGre's"
