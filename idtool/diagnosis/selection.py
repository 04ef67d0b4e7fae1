"""Which effects the data ask for: score, refit, accept on left-out trials, repeat, drop.

One round: every effect that these data can show is scored by regressing the residual on its columns,
with the fit's own Jacobian projected out. The best few are refitted jointly. The best of those is
accepted if it lowers the error on left-out trials by more than chance and by enough to matter. Of two
that tie the simpler is taken. When nothing passes, effects that became unneeded are dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from idtool.diagnosis.evidence import Background, Score, left_out_errors, score
from idtool.diagnosis.lines import strongest_line
from idtool.diagnosis.residual import test_residual
from idtool.effects.base import Effect, derivative
from idtool.fit.choose import with_load
from idtool.fit.joint import JointFit, gain_in_evidence, refit, settle, solve
from idtool.fit.model import JointModel
from idtool.fit.restart import restart, worth_a_restart
from idtool.fit.starts import with_starts
from idtool.model.motion import Array
from idtool.model.torque import Direction

#: Family-wise error of the score tests of one round (Holm).
_ALPHA = 1e-3
#: An effect must lower the left-out error by this share at least: less is not worth a parameter.
LEAST_GAIN = 0.01
#: ... and by so many standard errors of the difference over trials.
_CLEAR = 2.0
#: Bayesian evidence that a larger model needs (Kass & Raftery 1995 call 6 "strong").
_LEAST_EVIDENCE = 6.0
#: An effect must take away this many times what still depends on its variable.
_MIMIC = 3.0
_REFITTED = 4
#: Evaluations for a candidate's refit: one that has not come near by then is the wrong one.
_SPENT = 20
_MOST_EFFECTS = 8


@dataclass
class Candidate:
    """What became of an effect.

    Attributes:
        name: the effect.
        gain: share of squared error that its score promises; None where it could not be tested.
        p_value: of its score, corrected for its many starts.
        held_out: left-out error (root mean square, filtered rows) with it; None if not refitted.
        accepted: whether it is in the model.
        why: in words.
    """

    name: str
    gain: float | None = None
    p_value: float | None = None
    held_out: float | None = None
    accepted: bool = False
    why: str = ""


@dataclass(frozen=True)
class Trial:
    """A candidate model after its joint refit."""

    effect: Effect
    fit: JointFit
    left_out: Array
    p_value: float


@dataclass
class Selection:
    """The outcome.

    Attributes:
        fit: the final model on the training trials.
        candidates: one per effect of the library.
        alternatives: accepted effect -> effects that explain the data as well.
        p_values: accepted effect -> p-value when it was accepted.
        rivals: accepted effect -> the fit with its first alternative in its place.
        searched: the last fit whose friction curve was searched for anew.
    """

    fit: JointFit
    candidates: dict[str, Candidate]
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    p_values: dict[str, float] = field(default_factory=dict)
    rivals: dict[str, JointFit] = field(default_factory=dict)
    searched: JointFit | None = None


def select(
    base: JointFit, library: Sequence[Effect], tell: Callable[[str], None] = lambda _: None
) -> Selection:
    """Extend `base` by the effects that the data ask for.

    Args:
        base: a fit of the paper's model on the training trials.
        library: the effects to consider, simplest first.
        tell: called with a sentence on what is being tried.
    """
    selection = Selection(base, {effect.name: Candidate(effect.name) for effect in library})
    _begin_with_inertia(selection, library)
    for _ in range(_MOST_EFFECTS):
        winner = _round(selection, library, tell)
        if winner is not None:
            tell(f"accepted {winner.effect.name}")
        elif not _searched_anew(selection, tell):
            break
    _drop_unneeded(selection, tell)
    _drop_mimics(selection, tell)
    _simplify(selection, library, tell)
    _find_alternatives(selection, library, tell)
    return selection


def _begin_with_inertia(selection: Selection, library: Sequence[Effect]) -> None:
    """Take inertia in at once where the likelihood asks for it: every axis has it, and what it leaves in the
    residual would be mistaken for something else. At the end it is dropped if it is not needed."""
    inertia = next((effect for effect in library if effect.name == "inertia"), None)
    if inertia is None or inertia.missing(selection.fit.model.recording.motion):
        return
    best, start, _ = best_score(Background.of(selection.fit), inertia)
    if best.p_value > _ALPHA:
        return
    trial = _try(selection.fit, inertia, best, start, best.p_value)
    if (
        gain_in_evidence(selection.fit, trial.fit) > _LEAST_EVIDENCE
        and trial.fit.values["inertia.inertia"] > 0
    ):
        candidate = selection.candidates["inertia"]
        candidate.gain, candidate.p_value, candidate.accepted = best.gain, best.p_value, True
        candidate.held_out, candidate.why = root_mean(trial.left_out, trial.fit), "every axis has it"
        selection.fit, selection.p_values["inertia"] = _with_its_own_load(trial.fit), best.p_value


def _searched_anew(selection: Selection, tell: Callable[[str], None]) -> bool:
    """Look for a better friction curve when no effect passes; True if there was one, which a wrong curve
    may have hidden effects from."""
    if selection.fit is selection.searched:
        return False
    tell("looking for a better friction curve")
    before, selection.fit = selection.fit, restart(selection.fit)
    selection.searched = selection.fit
    return selection.fit is not before


def _round(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> Trial | None:
    fit = selection.fit
    background = Background.of(fit)
    scored: list[tuple[Effect, Score, dict[str, float], int]] = []
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
        best, start, tried = best_score(background, effect)
        candidate.gain, candidate.p_value = best.gain, min(1.0, best.p_value * tried)
        scored.append((effect, best, start, tried))
    promising = _holm(selection, scored)
    left_out = left_out_errors(fit)
    trials: list[Trial] = []
    for effect, best, start, _ in promising[:_REFITTED]:
        tell(f"trying {effect.name}")
        trials.append(_try(fit, effect, best, start, selection.candidates[effect.name].p_value or 0.0))
    for effect, *_ in promising[_REFITTED:]:
        selection.candidates[effect.name].why = "its score was behind that of the effects that were refitted"
    passed = [trial for trial in trials if _passes(selection, trial, left_out)]
    if not passed:
        return None
    winner = _simplest_of_best(selection, passed)
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
    selection.p_values[winner.effect.name] = winner.p_value
    return winner


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


def best_score(background: Background, effect: Effect) -> tuple[Score, dict[str, float], int]:
    """The best start of an effect: its score, the start's coordinates, and how many were tried."""
    model = background.fit.model
    motion = model.recording.motion
    starts = effect.starts(motion)
    coordinates = effect.active(motion)
    constants = effect.constants(motion)
    null = {**constants, **{c.name: c.null for c in coordinates}}
    tried = len(starts)
    wave = effect.wave(motion)
    if wave is not None:
        frequency, tried = strongest_line(background, wave.of[model.recording.row], wave.lowest, wave.highest)
        starts = [{wave.coordinate: frequency}]
    best: tuple[Score, dict[str, float]] | None = None
    for start in starts:
        strengths = [c for c in coordinates if c.name not in start]
        values = {**null, **start}
        directions = [Direction(effect=derivative(effect, motion, values, c)) for c in strengths]
        fit = background.fit
        columns = model.project(fit.x, fit.bend, fit.start, directions).jacobian
        assert columns is not None
        result = score(background, columns)
        # what the effect cannot do (a strength below zero) does not count for it
        able = [c.lower <= values[c.name] + d <= c.upper for c, d in zip(strengths, result.step, strict=True)]
        if not all(able):
            result = score(background, columns * np.array(able))
        found = {**start}
        for c, step in zip(strengths, result.step, strict=True):
            found[c.name] = float(np.clip(values[c.name] + step, c.lower, c.upper))
        if best is None or result.gain > best[0].gain:
            best = (result, found)
    assert best is not None
    return best[0], best[1], tried


def _holm(
    selection: Selection, scored: list[tuple[Effect, Score, dict[str, float], int]]
) -> list[tuple[Effect, Score, dict[str, float], int]]:
    """Candidates whose score stands out of chance, best gain first."""
    order = sorted(scored, key=lambda item: selection.candidates[item[0].name].p_value or 0.0)
    passed = []
    open_tests = len(order)
    for rank, item in enumerate(order):
        candidate = selection.candidates[item[0].name]
        p = candidate.p_value or 0.0
        if p > _ALPHA / (open_tests - rank):
            for loser in order[rank:]:
                selection.candidates[loser[0].name].why = "its relation to the residual may be chance"
            break
        if item[1].gain < LEAST_GAIN:
            candidate.why = f"would lower the squared error by {100 * item[1].gain:.2g} % only"
            continue
        passed.append(item)
    return sorted(passed, key=lambda item: -item[1].gain)


def _try(fit: JointFit, effect: Effect, best: Score, start: dict[str, float], p_value: float) -> Trial:
    model = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
    extra = {f"{effect.name}.{name}": value for name, value in start.items()}
    new = refit(fit, model, extra, most=_SPENT)
    return Trial(effect, new, left_out_errors(new), p_value)


def root_mean(errors: Array, fit: JointFit) -> float:
    """Left-out errors as one root mean square over the filtered rows."""
    return float(np.sqrt(errors.sum() / len(fit.residual)))


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
    elif clear < _CLEAR and evidence < 10 * _LEAST_EVIDENCE:
        candidate.why = f"better on some left-out trials only ({clear:.1f} standard errors)"
    elif evidence < _LEAST_EVIDENCE:
        candidate.why = f"the penalised likelihood gains {evidence:.1f} only"
    else:
        candidate.why = "another effect lowers the left-out error more"
        return True
    return False


def implausible(fit: JointFit, effect: Effect) -> str | None:
    """Why the fitted values cannot be that effect, as a sentence; None if they can."""
    return effect.implausible(fit.model.effect_values(fit.x, effect), fit.values)


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


def ties(one: Array, other: Array) -> bool:
    """Whether left-out errors of two models differ by less than chance and by less than matters."""
    difference = one - other
    chance = float(np.std(difference, ddof=1)) * np.sqrt(len(difference)) if len(difference) > 1 else 0.0
    total = min(float(one.sum()), float(other.sum()))
    return (
        abs(float(difference.sum())) < max(2.0 * chance, LEAST_GAIN * total)
        and abs(float(difference.sum())) < 4.0 * LEAST_GAIN * total
    )


def _drop_unneeded(selection: Selection, tell: Callable[[str], None]) -> None:
    dropped = True
    while dropped:
        dropped = False
        fit = selection.fit
        newest = fit.model.spec.effects[-1:]
        for effect in fit.model.spec.effects:
            impossible = implausible(fit, effect)
            if (effect,) == newest and not impossible:
                continue  # that it is needed was found just now
            model = JointModel.build(
                fit.model.recording, fit.model.spec.without(effect.name), fit.model.constants
            )
            tell(f"trying without {effect.name}")
            smaller = refit(fit, model)
            needed = root_mean(left_out_errors(smaller), smaller) > (1.0 + LEAST_GAIN) * root_mean(
                left_out_errors(fit), fit
            )
            if impossible or not needed:
                selection.fit = smaller
                candidate = selection.candidates[effect.name]
                candidate.accepted = False
                candidate.why = impossible or "became unneeded when other effects were in"
                selection.alternatives.pop(effect.name, None)
                selection.p_values.pop(effect.name, None)
                dropped = True
                break


def _drop_mimics(selection: Selection, tell: Callable[[str], None]) -> None:
    """Drop effects that follow only a part of something else.

    A bump at one place has a Fourier component that a ripple can take away, and what is left still depends on
    the place. An effect is not the explanation where what is left over its own variable is of the order of
    what it took away.
    """
    while True:
        fit = selection.fit
        left = {test.variable: test.share * fit.sse for test in test_residual(fit) if test.depends}
        suspects = [
            (max(left[variable] for variable in effect.follows if variable in left), effect)
            for effect in fit.model.spec.effects
            if effect.name != "inertia" and left.keys() & set(effect.follows)
        ]
        mimics = []
        for remains, effect in suspects:
            tell(f"trying without {effect.name}")
            model = JointModel.build(
                fit.model.recording, fit.model.spec.without(effect.name), fit.model.constants
            )
            smaller = refit(fit, model)
            if smaller.sse - fit.sse < _MIMIC * remains:
                mimics.append((smaller.sse, effect, smaller))
        if not mimics:
            return
        _, effect, selection.fit = min(mimics, key=lambda mimic: mimic[0])
        candidate = selection.candidates[effect.name]
        candidate.accepted = False
        candidate.why = f"follows only a part of what depends on {' and '.join(effect.follows)}"
        selection.alternatives.pop(effect.name, None)
        selection.p_values.pop(effect.name, None)


def _simplify(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> None:
    """Put a special case in the place of an accepted effect wherever it does as well."""
    by_name = {effect.name: effect for effect in library}
    for effect in selection.fit.model.spec.effects:
        for name in effect.absorbs:
            if name not in by_name or by_name[name].missing(selection.fit.model.recording.motion):
                continue
            tell(f"trying {name} in place of {effect.name}")
            fit = selection.fit
            swapped = _swap(fit, effect, by_name[name])
            before, after = left_out_errors(fit), swapped.left_out
            if root_mean(after, swapped.fit) > (1.0 + LEAST_GAIN) * root_mean(before, fit):
                continue
            selection.fit = swapped.fit
            loser, winner = selection.candidates[effect.name], selection.candidates[name]
            loser.accepted, loser.why = False, f"its special case {name} does as well"
            winner.accepted, winner.why = True, "lowers the error on left-out trials"
            winner.held_out = root_mean(after, swapped.fit)
            selection.p_values[name] = selection.p_values.pop(effect.name, swapped.p_value)
            selection.alternatives.pop(effect.name, None)
            break


def _find_alternatives(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> None:
    """For each accepted effect, the equally simple ones that explain the data as well in its place.

    Candidates are those that tied when it was accepted, and its known look-alikes. Inertia, which every
    axis has, is not put in question.
    """
    by_name = {effect.name: effect for effect in library}
    fit = selection.fit
    motion = fit.model.recording.motion
    left_out = left_out_errors(fit)
    found: dict[str, list[str]] = {}
    for effect in fit.model.spec.effects:
        if effect.name == "inertia":
            continue
        size = len(effect.active(motion))
        names = dict.fromkeys([*selection.alternatives.get(effect.name, []), *effect.look_alikes])
        for name in names:
            other = by_name.get(name)
            if other is None or selection.candidates[name].accepted or other.missing(motion):
                continue
            if len(other.active(motion)) != size:
                continue
            tell(f"trying {name} in place of {effect.name}")
            swapped = _swap(fit, effect, other)
            if len(swapped.fit.x) == len(fit.x) and ties(swapped.left_out, left_out):
                found.setdefault(effect.name, []).append(name)
                selection.rivals.setdefault(effect.name, swapped.fit)
                selection.candidates[name].why = f"explains the data as well as {effect.name}, which is taken"
    selection.alternatives = found


def _swap(fit: JointFit, effect: Effect, other: Effect) -> Trial:
    """The fit with `other` in the place of `effect`."""
    without = refit(
        fit, JointModel.build(fit.model.recording, fit.model.spec.without(effect.name), fit.model.constants)
    )
    best, start, tried = best_score(Background.of(without), other)
    return _try(without, other, best, start, min(1.0, best.p_value * tried))
