"""What a model is better by: where the axis slides, or only after turns.

What LuGre's bristle does not follow of a presliding is left after every turn, for any shape to follow: for an
effect that is not there, or for a friction curve that bends so far that it stands for viscous friction.
"""

from __future__ import annotations

from idtool.diagnosis.shapes import Unnamed
from idtool.effects.base import Effect
from idtool.fit.joint import JointFit
from idtool.fit.left_out import SURELY, left_out_error, predicts_better
from idtool.fit.restart import rises, rises_all_along
from idtool.model.motion import Array, since_reversal

#: The bristle has forgotten a reversal after so many of its bends (3e-4 is left).
SETTLED = 8.0
#: Of what an effect takes away that no turn calls up, rows that slide have this share of their due at least.
_OF_SLIDING = 0.5
#: A friction curve that rises and leaves less than this share of the viscous friction stands for it.
_OWN_VISCOUS = 0.5
#: What is said of an effect that is nothing else.
OF_PRESLIDING = "what it takes away is left after turns, by a presliding that is none of LuGre's"


def of_presliding(smaller: JointFit, larger: JointFit, effect: Effect) -> bool:
    """Whether an effect that no turn calls up takes away too little where the axis slides: what a presliding
    that is none of LuGre's leaves after each turn is there for any shape to follow.

    Args:
        smaller: the model without it.
        larger: the model with it.
    """
    if isinstance(effect, Unnamed) or effect.is_lag or effect.free_start or effect.after_reversal:
        return False
    return better_after_turns(larger, smaller)


def doubtful(rival: JointFit, fit: JointFit) -> bool:
    """Whether a friction curve that rises all along, as viscous friction does, makes a model better than one
    whose curve does not, but not surely, or not where the axis slides."""
    if not rises_all_along(rival) or rises_all_along(fit):
        return False
    return SURELY * left_out_error(rival) > left_out_error(fit) or better_after_turns(rival, fit)


def better_after_turns(one: JointFit, other: JointFit) -> bool:
    """Whether rows that slide steadily, on which the bristle of another model has forgotten the last turn,
    have less than half of their due in what one leaves less than that."""
    settled = since_turn(other) > SETTLED * other.presliding_scale
    gained = other.residual**2 - one.residual**2
    return bool(gained[settled].sum() < _OF_SLIDING * settled.mean() * gained.sum())


def since_turn(fit: JointFit) -> Array:
    """How far the axis went since its last turn, shape (filtered rows,)."""
    recording = fit.model.recording
    motion = recording.motion
    return since_reversal(motion.position, motion.velocity, motion.trial)[recording.row]


def outdoes(rival: JointFit, fit: JointFit) -> bool:
    """Whether a model predicts better than another one, and not by a friction curve that is to be doubted."""
    return not doubtful(rival, fit) and predicts_better(rival, fit)


def stands_for_viscous_friction(before: JointFit, after: JointFit) -> bool:
    """Whether a friction curve that rises has come to stand for most of the viscous friction, and trials that
    are left out do not surely ask for it."""
    if rises_all_along(before) or not rises(after):
        return False
    if not (rises_all_along(after) or after.values["viscous"] < _OWN_VISCOUS * before.values["viscous"]):
        return False
    return SURELY * left_out_error(after) >= left_out_error(before)
