"""What an effect has to do to come in."""

from __future__ import annotations

from idtool.diagnosis.candidates import LEAST_GAIN, chance_beside
from idtool.diagnosis.plausible import CHANCE, WORTH, impossible, worth_beside, worth_it
from idtool.diagnosis.sliding import OF_PRESLIDING, of_presliding, stands_for_viscous_friction
from idtool.diagnosis.state import Selection, Trial
from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.fit.identifiability import is_vague
from idtool.fit.joint import gain_in_evidence
from idtool.fit.left_out import predicts_better

#: An effect must take away this share of what is not explained: what only nibbles at the residual of
#: something else, or at what a shape without a name does not follow of it, is not its explanation.
_LEAST_OF_EXCESS = 0.05
#: Bayesian evidence for a lag, whose many numbers follow much (Kass & Raftery 1995 call 6 "strong").
_LEAST_EVIDENCE = 6.0


def pushed_out(selection: Selection, trial: Trial) -> list[Effect]:
    """The effects of the model that cannot be any more beside that of a trial; an inertia that the data did
    not show before is none of them."""
    return [
        other
        for other in selection.fit.model.spec.effects
        if other.name != trial.effect.name
        and other in trial.fit.model.spec.effects
        and impossible(trial.fit, other)
        and not impossible(selection.fit, other)
        and not (other.name == "inertia" and is_vague(selection.fit, "inertia.inertia"))
    ]


def lowers(old: float, new: float) -> bool:
    """Whether a left-out error is lower by enough to matter."""
    return new <= (1.0 - LEAST_GAIN) * old


def why_not(selection: Selection, trial: Trial, old: float, new: float) -> str | None:
    """Why a trial does not pass; None if it does.

    Args:
        selection: what was found so far.
        trial: the model with the effect.
        old, new: left-out errors without it and with it.
    """
    if reason := impossible(trial.fit, trial.effect):
        return reason
    if not worth_it(trial.fit, trial.effect):
        return f"it would be less than {100 * WORTH:.0f} % of the friction"
    inside = {effect.name: effect for effect in selection.fit.model.spec.effects}
    special = [inside[name].title.lower() for name in trial.effect.absorbs if name in inside]
    if special and not worth_beside(trial.fit, selection.fit):
        return f"it would add less than {100 * WORTH:.0f} % of the friction to {special[0]}"
    if stands_for_viscous_friction(selection.fit, trial.fit):
        return "beside it the friction curve would rise all along and stand for viscous friction"
    for name in trial.effect.absorbs:
        alone = registry.get(name)
        if name in inside or alone.missing(trial.fit.model.recording.motion):
            continue
        if chance_beside(trial.fit, trial.effect, alone, selection.fit) > CHANCE:
            return f"what it adds to {alone.title.lower()} may be chance"
    # what an effect adds to its special case may be told by turns alone: drive and backdrive, on a load that
    # always pulls one way, from load friction and another weight
    if not special and of_presliding(selection.fit, trial.fit, trial.effect):
        return OF_PRESLIDING
    if not lowers(old, new):
        return f"left-out error {new:.4g} against {old:.4g} without it: not enough to matter"
    if not predicts_better(trial.fit, selection.fit):
        return f"left-out error {new:.4g} against {old:.4g} without it: no more than chance between trials"
    if old**2 - new**2 < _LEAST_OF_EXCESS * selection.unexplained:
        return f"left-out error {new:.4g} against {old:.4g}: a small part of what is too much"
    evidence = gain_in_evidence(selection.fit, trial.fit)
    if trial.effect.is_lag and evidence < _LEAST_EVIDENCE:
        return f"the penalised likelihood gains {evidence:.1f} only"
    return None
