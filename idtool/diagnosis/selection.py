"""Which effects the data ask for: score, refit, accept on left-out trials, repeat, drop.

One round: every effect that these data can show is scored by regressing the residual on its columns,
with the fit's own Jacobian projected out. The best few are refitted jointly. The best of those is
accepted if it lowers the error on left-out trials by more than chance and by enough to matter. Of two
that tie the simpler is taken. When nothing passes, effects that became unneeded are dropped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from idtool.diagnosis.candidates import (
    LEAST_GAIN,
    LEAST_OF_EXCESS,
    Candidate,
    Selection,
    Trial,
    best_score,
    implausible,
    root_mean,
    ties,
    try_effect,
)
from idtool.diagnosis.evidence import Background, Score, left_out_errors
from idtool.diagnosis.holm import holm
from idtool.diagnosis.pruning import drop_mimics, drop_unneeded, find_alternatives, simplify
from idtool.diagnosis.residual import test_residual
from idtool.effects.base import Effect
from idtool.fit.choose import with_load
from idtool.fit.joint import JointFit, gain_in_evidence, refit, settle, solve
from idtool.fit.model import JointModel
from idtool.fit.restart import restart, worth_a_restart
from idtool.fit.starts import with_starts
from idtool.model.motion import Array

#: Family-wise error of the score tests of one round (Holm).
_ALPHA = 1e-3
#: A larger model must be better by so many standard errors of the difference over trials.
_CLEAR = 2.0
#: Bayesian evidence that a larger model needs (Kass & Raftery 1995 call 6 "strong").
_LEAST_EVIDENCE = 6.0
_REFITTED = 4
_MOST_EFFECTS = 8
#: Logarithm of the bristle's stiffness: further than that from where the search began, friction is bent.
_BENT = 1.0


@dataclass(frozen=True)
class _Scored:
    """An effect's best start, and the fit that it starts from."""

    effect: Effect
    best: Score
    start: dict[str, float]
    p_value: float
    fit: JointFit

    def left(self) -> float:
        """Sum of squares that its score promises to leave."""
        return (1.0 - self.best.gain) * self.fit.sse


def _score(effect: Effect, background: Background, among: Sequence[Background]) -> _Scored:
    best, start, tried = best_score(background, effect)
    return _Scored(effect, best, start, min(1.0, best.p_value * tried * len(among)), background.fit)


def select(
    base: JointFit,
    library: Sequence[Effect],
    tell: Callable[[str], None] = lambda _: None,
    *,
    given: bool = False,
    start: JointFit | None = None,
) -> Selection:
    """Extend `base` by the effects that the data ask for.

    Args:
        base: a fit of the paper's model on the training trials.
        library: the effects to consider, simplest first.
        tell: called with a sentence on what is being tried.
        given: the library is a model that somebody chose; its effects need not explain everything.
        start: where the search for the base model began; its friction was found with inertia and an offset
            allowed, so it is bent less by an effect that the base model lacks.
    """
    best = _greedy(base, library, tell, given=given, start=start)
    if given or not _left_over(best.fit):
        return best
    # the first step may have been the wrong one: others that would have done instead get their turn
    for trial in best.rivals_at_first:
        tell(f"starting again with {trial.effect.name}")
        other = _greedy(base, library, tell, first=trial)
        if not _left_over(other.fit) and other.fit.sse < best.fit.sse:
            return other
    return best


def _greedy(
    base: JointFit,
    library: Sequence[Effect],
    tell: Callable[[str], None],
    *,
    first: Trial | None = None,
    given: bool = False,
    start: JointFit | None = None,
) -> Selection:
    """One effect after another, `first` before all others if given; then second thoughts."""
    selection = Selection(base, {effect.name: Candidate(effect.name) for effect in library})
    _begin_with_inertia(selection, library)
    if first is not None:
        _accept(selection, first)
    unbent = start and _with_the_friction_of(start, selection.fit)
    for number in range(_MOST_EFFECTS):
        winner = _round(selection, library, tell, unbent, note_rivals=number == 0 and first is None)
        unbent = None
        if winner is not None:
            tell(f"accepted {winner.effect.name}")
        elif not _searched_anew(selection, tell):
            break
    drop_unneeded(selection, tell)
    if not given:
        drop_mimics(selection, tell)
    simplify(selection, library, tell)
    find_alternatives(selection, library, tell)
    return selection


def _left_over(fit: JointFit) -> bool:
    """Whether the residual still depends on something."""
    return any(test.depends for test in test_residual(fit))


def _begin_with_inertia(selection: Selection, library: Sequence[Effect]) -> None:
    """Take inertia in at once where the likelihood asks for it: every axis has it, and what it leaves in the
    residual would be mistaken for something else. At the end it is dropped if it is not needed."""
    inertia = next((effect for effect in library if effect.name == "inertia"), None)
    if inertia is None or inertia.missing(selection.fit.model.recording.motion):
        return
    best, start, _ = best_score(Background.of(selection.fit), inertia)
    if best.p_value > _ALPHA:
        return
    trial = try_effect(selection.fit, inertia, best, start, best.p_value)
    if (
        gain_in_evidence(selection.fit, trial.fit) > _LEAST_EVIDENCE
        and trial.fit.values["inertia.inertia"] > 0
    ):
        candidate = selection.candidates["inertia"]
        candidate.gain, candidate.p_value, candidate.accepted = best.gain, best.p_value, True
        candidate.held_out, candidate.why = root_mean(trial.left_out, trial.fit), "every axis has it"
        selection.fit, selection.p_values["inertia"] = _with_its_own_load(trial.fit), best.p_value


def _with_the_friction_of(start: JointFit, fit: JointFit) -> JointFit | None:
    """The model of `fit` with the friction held as in `start`; None where the two hardly differ.

    A bristle that is soft enough turns an unknown start deflection into any torque that a trial needs. A
    base model that lacks an effect can so take it in, and hides it from the scores.
    """
    names = frozenset(fit.model.friction_coordinates)
    if "bristle_stiffness" not in names or not names <= set(start.model.names):
        return None
    if abs(math.log(fit.values["bristle_stiffness"] / start.values["bristle_stiffness"])) < _BENT:
        return None
    values = fit.values | {name: start.values[name] for name in names}
    return solve(fit.model, fit.model.coordinates(values), held=names)


def _searched_anew(selection: Selection, tell: Callable[[str], None]) -> bool:
    """Look for a better friction curve when no effect passes; True if there was one, which a wrong curve
    may have hidden effects from."""
    if selection.fit is selection.searched:
        return False
    tell("looking for a better friction curve")
    before, selection.fit = selection.fit, restart(selection.fit)
    selection.searched = selection.fit
    return selection.fit is not before


def _round(
    selection: Selection,
    library: Sequence[Effect],
    tell: Callable[[str], None],
    unbent: JointFit | None,
    *,
    note_rivals: bool,
) -> Trial | None:
    fit = selection.fit
    backgrounds = [Background.of(each) for each in (fit, unbent) if each is not None]
    scored: list[_Scored] = []
    for effect in library:
        candidate = selection.candidates[effect.name]
        if candidate.accepted:
            continue
        covering = [e.name for e in fit.model.spec.effects if effect.name in e.absorbs]
        if covering:
            candidate.why = f"is a special case of {covering[0]}, which is in"
            continue
        if reason := effect.missing(fit.model.recording.motion):
            candidate.why = f"not testable: {reason}"
            continue
        item = min((_score(effect, background, backgrounds) for background in backgrounds), key=_Scored.left)
        candidate.gain, candidate.p_value = 1.0 - item.left() / fit.sse, item.p_value
        scored.append(item)
    promising = _promising(selection, scored)
    left_out = left_out_errors(fit)
    trials: list[Trial] = []
    for item in promising[:_REFITTED]:
        tell(f"trying {item.effect.name}")
        trials.append(try_effect(item.fit, item.effect, item.best, item.start, item.p_value))
    for item in promising[_REFITTED:]:
        selection.candidates[
            item.effect.name
        ].why = "its score was behind that of the effects that were refitted"
    passed = [trial for trial in trials if _passes(selection, trial, left_out)]
    if not passed:
        return None
    winner = _simplest_of_best(selection, passed)
    if note_rivals:
        selection.rivals_at_first = [trial for trial in passed if trial is not winner]
    _accept(selection, winner)
    return winner


def _accept(selection: Selection, winner: Trial) -> None:
    """Take an effect in, finish its fit, and look whether the friction curve was bent to make up for it."""
    for absorbed in winner.effect.absorbs:
        if absorbed in selection.candidates and selection.candidates[absorbed].accepted:
            selection.candidates[absorbed].accepted = False
            selection.candidates[
                absorbed
            ].why = f"is a special case of {winner.effect.name}, which took its place"
            selection.alternatives.pop(absorbed, None)
            selection.p_values.pop(absorbed, None)
    selection.fit = settle(solve(winner.fit.model, winner.fit.x, bend=winner.fit.bend))
    if worth_a_restart(selection.fit):
        selection.fit = selection.searched = restart(selection.fit)
    selection.fit = _with_its_own_load(selection.fit)
    candidate = selection.candidates[winner.effect.name]
    candidate.accepted, candidate.why = True, "lowers the error on left-out trials"
    candidate.p_value, candidate.held_out = winner.p_value, root_mean(winner.left_out, winner.fit)
    selection.p_values[winner.effect.name] = winner.p_value


def _with_its_own_load(fit: JointFit) -> JointFit:
    """The fit with the load that its own gravity puts on the axis: what an effect that was missing did to the
    gravity before it came in must not stay in the load of those that depend on it."""
    model = fit.model
    recording = with_load(model.recording, fit)
    before, now = model.recording.motion.load, recording.motion.load
    if before is None or now is None or np.allclose(before, now, rtol=1e-4, atol=1e-4 * float(np.ptp(now))):
        return fit
    loaded = JointModel.build(recording, model.spec, model.constants)
    if any("load" in need for effect in model.spec.effects for need in effect.needs):
        return refit(fit, loaded)
    return replace(fit, model=with_starts(loaded, model.starts))


def _promising(selection: Selection, scored: list[_Scored]) -> list[_Scored]:
    """Candidates whose score stands out of chance, best gain first."""
    chance = holm({item.effect.name: item.p_value for item in scored})
    passed = []
    for item in scored:
        candidate = selection.candidates[item.effect.name]
        gain = candidate.gain or 0.0
        if chance[item.effect.name] > _ALPHA:
            candidate.why = "its relation to the residual may be chance"
        elif gain < LEAST_GAIN:
            candidate.why = f"would lower the squared error by {100 * max(gain, 0.0):.2g} % only"
        else:
            passed.append(item)
    return sorted(passed, key=_Scored.left)


def _passes(selection: Selection, trial: Trial, before: Array) -> bool:
    candidate = selection.candidates[trial.effect.name]
    candidate.held_out = root_mean(trial.left_out, trial.fit)
    old, new = root_mean(before, selection.fit), candidate.held_out
    better = before - trial.left_out
    clear = better.mean() / max(float(np.std(better, ddof=1)) / np.sqrt(len(better)), 1e-300)
    evidence = gain_in_evidence(selection.fit, trial.fit)
    if any(trial.fit.at_bound[n] for n in trial.fit.model.names if n.startswith(f"{trial.effect.name}.")):
        candidate.why = "its parameter ran to a bound"
    elif reason := implausible(trial.fit, trial.effect):
        candidate.why = reason
    elif new > (1.0 - LEAST_GAIN) * old:
        candidate.why = f"left-out error {new:.4g} against {old:.4g} without it: not enough to matter"
    elif old**2 - new**2 < LEAST_OF_EXCESS * (old**2 - selection.fit.model.filtered_noise**2):
        candidate.why = f"left-out error {new:.4g} against {old:.4g}: a small part of what is too much"
    elif clear < _CLEAR and evidence < 10 * _LEAST_EVIDENCE:
        candidate.why = f"better on some left-out trials only ({clear:.1f} standard errors)"
    elif evidence < _LEAST_EVIDENCE:
        candidate.why = f"the penalised likelihood gains {evidence:.1f} only"
    else:
        candidate.why = "another effect lowers the left-out error more"
        return True
    return False


def _simplest_of_best(selection: Selection, passed: list[Trial]) -> Trial:
    best = min(passed, key=lambda trial: trial.left_out.sum())
    tied = [trial for trial in passed if trial is best or ties(trial.left_out, best.left_out)]
    order = list(selection.candidates)  # the library's order: simplest first
    winner = min(tied, key=lambda trial: (len(trial.fit.x), order.index(trial.effect.name)))
    names = [trial.effect.name for trial in tied if trial is not winner]
    if names:
        selection.alternatives[winner.effect.name] = names
        for name in names:
            selection.candidates[
                name
            ].why = f"explains the data as well as {winner.effect.name}, which is taken"
    return winner
