"""Which effects the data ask for: score, refit, accept on left-out folds, repeat, drop.

One round: every effect that these data can show is scored by regressing the residual on its columns,
with the fit's own Jacobian projected out. The best few are refitted jointly, and with them all that could
stand for the same evidence. The best of those is accepted if it lowers the error on left-out folds by more
than chance and by enough to matter. Of two that tie the simpler is taken. Local shapes without a name
compete like effects (`shapes`). When nothing passes, two that hide each other are tried (`pairs`), and then
effects that became unneeded are dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from idtool.diagnosis.candidates import LEAST_GAIN, Start, best_start, ties, try_effect, without
from idtool.diagnosis.evidence import chance_of
from idtool.diagnosis.holm import holm
from idtool.diagnosis.pairs import hidden_pairs
from idtool.diagnosis.passing import lowers, pushed_out, why_not
from idtool.diagnosis.pruning import drop_unneeded, find_alternatives, one_for_many, simplify
from idtool.diagnosis.shapes import UNNAMED, Unnamed
from idtool.diagnosis.sliding import stands_for_viscous_friction
from idtool.diagnosis.state import Candidate, Rival, Selection, Trial
from idtool.effects.base import Effect
from idtool.fit.choose import with_load
from idtool.fit.joint import JointFit, kept, refit, settle, solve
from idtool.fit.left_out import left_out_error, prediction_errors
from idtool.fit.model import JointModel
from idtool.fit.restart import restart, worth_a_restart
from idtool.model.motion import Motion

#: Family-wise error of the score tests of one round (Holm): chance in one session of a hundred.
ALPHA = 0.01
_REFITTED = 4
#: ... of those whose score promises to leave not much more than that of one that passed. Rounds go on: they
#: are refitted when that is in.
BEHIND = 1.3
_MOST_ROUNDS = 24
#: What is told of an effect that comes in begins so.
ACCEPTED = "accepted"
#: A bristle that bends over more than this share of the stroke can hide an effect from its score.
_BENT = 0.03


@dataclass(frozen=True, eq=False)
class _Scored:
    """An effect's best start, the fit that it starts from, and its start from the fit that is extended."""

    effect: Effect
    start: Start
    fit: JointFit
    plain: Start

    def left(self) -> float:
        """Sum of squares that its score promises to leave."""
        return (1.0 - self.start.gain) * self.fit.sse


def begun(base: JointFit, library: Sequence[Effect]) -> Selection:
    """A selection that holds what the base model has, of the effects to consider, simplest first."""
    selection = Selection(base, {effect.name: Candidate(effect.name) for effect in library})
    for effect in base.model.spec.effects:
        candidate = selection.candidates.setdefault(effect.name, Candidate(effect.name))
        candidate.accepted, candidate.why = True, "every axis has it"
    return selection


def extend(
    selection: Selection,
    library: Sequence[Effect],
    tell: Callable[[str], None] = lambda _: None,
    *,
    given: bool = False,
    tolerance: float = 0.0,
    rival: Rival | None = None,
) -> None:
    """Add to a selection the effects that the data ask for.

    Args:
        selection: what was found so far, on the training rows.
        library: the effects to consider.
        tell: called with a sentence on what is being tried.
        given: the library is a model that somebody chose; its effects need not explain everything.
        tolerance: error that is good enough, share of the torque (rms).
        rival: beside it the selection is given up (`Selection.hopeless`) once that is simpler, or is ahead
            when nothing passes, or once it comes to where another selection has been.
    """
    allowed = library
    while True:
        _add(selection, _with_unnamed(allowed, given), tell, tolerance, rival)
        if selection.hopeless:
            return
        if not given and one_for_many(selection, tell):
            continue
        allowed = absorbed(drop_unneeded(selection, tell), library)
        if not allowed:
            break
    simplify(selection, library, tell)
    find_alternatives(selection, library, tell)


def one_by_one(
    selection: Selection,
    library: Sequence[Effect],
    tell: Callable[[str], None],
    *,
    given: bool = False,
    tolerance: float = 0.0,
    path: Sequence[JointFit] = (),
    rounds: int = _MOST_ROUNDS,
) -> None:
    """As `extend`, with nothing that takes long where no single effect passes, and nothing dropped; `path`:
    where another selection came by. One that predicts no better than that did a round before goes no
    further. `rounds`: effects that come in, at most."""
    for _ in range(rounds):
        if good_enough(selection.fit, tolerance):
            return
        winner = next_effect(selection, _with_unnamed(library, given), tell)
        if winner is None:
            return
        tell(f"{ACCEPTED} {winner.effect.title.lower()}")
        selection.steps.append(selection.fit)
        before = path[min(len(selection.steps), len(path)) - 1] if path else None
        if before is not None and left_out_error(selection.fit) >= left_out_error(before):
            return


def _with_unnamed(library: Sequence[Effect], given: bool) -> tuple[Effect, ...]:
    return (*library, *(() if given else UNNAMED))


def absorbed(gone: Sequence[Effect], library: Sequence[Effect]) -> list[Effect]:
    """The special cases of effects that are gone, which may come in their place."""
    names = {name for effect in gone for name in effect.absorbs}
    return [effect for effect in library if effect.name in names]


def _add(
    selection: Selection,
    library: Sequence[Effect],
    tell: Callable[[str], None],
    tolerance: float,
    rival: Rival | None,
) -> None:
    """Round after round, until none finds an effect, or there is no hope."""
    for _ in range(_MOST_ROUNDS):
        if good_enough(selection.fit, tolerance):
            return
        winner = next_effect(selection, library, tell)
        if winner is None and rival is not None and rival.is_ahead(selection.fit):
            selection.hopeless = True  # what is tried where nothing passes turns nothing round
            return
        if winner is None and not _searched_anew(selection, tell):
            winner = _on_another_curve(selection, library, tell) or _two_at_once(selection, library, tell)
            if winner is None:
                return
        if winner is not None:
            tell(f"{ACCEPTED} {winner.effect.title.lower()}")
        selection.step()
        selection.hopeless |= rival is not None and rival.is_simpler(selection.fit)
        if selection.hopeless:
            return


def good_enough(fit: JointFit, tolerance: float) -> bool:
    """Whether a fit leaves no more than this share of the torque (rms, filtered rows)."""
    return fit.rmse <= tolerance * float(np.sqrt(np.mean(fit.model.measured**2)))


@kept
def _beside_a_stiff_bristle(fit: JointFit) -> JointFit | None:
    """The same model with a bristle that hardly bends; None where it hardly bends anyway.

    A bristle that is soft enough turns an unknown start deflection into any torque that a trial needs, a
    spring and an offset among them, and hides them from the scores.
    """
    model = fit.model
    if "bristle_stiffness" not in model.names or fit.presliding_scale < _BENT * model.scales.travel:
        return None
    held = frozenset({"bristle_stiffness", "bristle_damping"})
    bend = max(0.2 * _BENT * model.scales.travel, model.scales.shortest_bend)
    values = fit.values | {
        "bristle_stiffness": max(fit.values["coulomb"], fit.values["static"]) / bend,
        "bristle_damping": 0.0,
    }
    return solve(model, model.coordinates(values), held=held)


def _searched_anew(selection: Selection, tell: Callable[[str], None]) -> bool:
    """Look for a better friction curve when no effect passes; True if there was one, which a wrong curve
    may have hidden effects from."""
    # a curve that was found while an effect was missing may be bent to make up for it
    extended = len(selection.fit.model.spec.effects) > 1
    if selection.fit is selection.searched or not (extended or worth_a_restart(selection.fit)):
        return False
    tell("looking for a better friction curve")
    before, found = selection.fit, restart(selection.fit)
    better = found is not before and left_out_error(found) < left_out_error(before)
    better &= not stands_for_viscous_friction(before, found)
    selection.fit = selection.searched = found if better else before
    return better


def _on_another_curve(
    selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]
) -> Trial | None:
    """Effects of the speed, each with the friction curve searched for anew: a Stribeck curve that is wide
    enough stands for friction that grows otherwise with the speed, and hides it from its score."""
    fit = selection.fit
    if "static" not in fit.model.names or not worth_a_restart(fit):
        return None
    passed: list[Trial] = []
    for effect in to_score(selection, library):
        if "velocity" not in effect.follows or isinstance(effect, Unnamed):
            continue
        tell(f"trying {effect.title.lower()} on another friction curve")
        refitted = restart(try_effect(fit, effect, best_start(fit, effect)).fit)
        passed += _in_full(selection, refitted, effect, library)
    return _accepted(selection, passed)


def _two_at_once(
    selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]
) -> Trial | None:
    """Two effects of which each hides the other: accepted together, or not."""
    fit = selection.fit
    effects = [effect for effect in to_score(selection, library) if not isinstance(effect, Unnamed)]
    scored = [(effect, best_start(fit, effect)) for effect in effects]
    passed: list[tuple[Trial, Trial]] = []
    for i, j in hidden_pairs(fit, scored, ALPHA, _REFITTED):
        (one, start), (other, _) = scored[i], scored[j]
        tell(f"trying {one.title.lower()} and {other.title.lower()} together")
        beside = try_effect(fit, one, start, far=True).fit
        best = best_start(beside, other)
        if best.columns is None:
            continue
        both = try_effect(beside, other, best, far=True).fit
        trials = Trial(one, both, chance_of(both, one)), Trial(other, both, chance_of(both, other))
        if all(trial.p_value < ALPHA and passing(selection, trial) for trial in trials):
            full = completed(both)
            if lowers(left_out_error(fit), left_out_error(full)):
                passed.append((replace(trials[0], fit=full), replace(trials[1], fit=full)))
    if not passed:
        return None
    winner = simplest_of_best(selection, [second for _, second in passed])
    for trial in next(pair for pair in passed if pair[1] is winner):
        accept(selection, trial)
    return winner


def next_effect(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> Trial | None:
    """One round: the effect that comes in next, the best of those that pass; None if none does."""
    fit = selection.fit
    stiff = _beside_a_stiff_bristle(fit)
    fits = [each for each in (fit, stiff) if each is not None]
    scored: list[_Scored] = []
    for effect in to_score(selection, library):
        starts = [best_start(each, effect) for each in fits]
        forms = [_Scored(effect, start, each, starts[0]) for start, each in zip(starts, fits, strict=True)]
        item = min(forms, key=lambda one: (one.start.p_value > ALPHA / len(library), one.left()))
        scored.append(item)
    for item in sorted(scored, key=lambda one: one.start.p_value, reverse=True):  # the best form is told
        candidate = _candidate(selection, item.effect)
        if not candidate.accepted:
            candidate.gain, candidate.p_value = item.start.gain, item.start.p_value
    promising = _promising(selection, scored)
    # one lag among the best brings the others
    lag = any(item.effect.is_lag for item in promising[:_REFITTED])
    lag |= not promising and worth_a_restart(fit)
    passed: list[Trial] = []
    special: set[str] = set()  # cases of those that were refitted: what these add to them may be chance
    promised = np.inf  # what the best score of one that passed leaves
    best_lag = np.inf  # what the best of the lags leaves of left-out trials, if it can be there or not
    for place, item in enumerate(promising):
        apart = (lag and item.effect.is_lag) or item.effect.name in special
        behind = item.left() > BEHIND * promised
        if not apart and (place >= _REFITTED or behind):
            _tell_why(selection, item.effect, "its score was behind that of the effects that were refitted")
            continue
        # lags and special cases beyond the best few come besides
        most = min(len(promising), _REFITTED)
        counted = f" ({place + 1} of at most {most})" if place < most else ""
        tell(f"trying {item.effect.title.lower()}{counted}")
        trial = try_effect(item.fit, item.effect, item.start, far=item.fit is not fit or item.effect.is_lag)
        if item.fit is not fit and trial.fit.sse > fit.sse:  # the bristle did not find back
            trial = replace(try_effect(fit, item.effect, item.plain, far=True), p_value=item.start.p_value)
        special.update(item.effect.absorbs)
        good = passing(selection, trial)
        passed += good
        if item.effect.is_lag:
            best_lag = min(best_lag, left_out_error(trial.fit))
        promised = min(promised, item.left()) if good else promised
    # a lag whose score may be chance competes with other lags, be it one that leaves least and cannot be
    # there, or comes last
    leads = best_lag <= min((left_out_error(trial.fit) for trial in passed), default=np.inf)
    alone = lag and (leads or any(trial.effect.is_lag for trial in passed))
    for item in scored if alone else ():
        if item.effect.is_lag and item not in promising:
            # what damping and inertia do in its place bends a fit so far that no score from there tells
            tell(f"trying {item.effect.title.lower()}")
            passed += _in_full(
                selection, try_effect(fit, item.effect, item.plain, far=True).fit, item.effect, library
            )
    return _accepted(selection, passed)


def _in_full(
    selection: Selection, refitted: JointFit, effect: Effect, library: Sequence[Effect]
) -> list[Trial]:
    """The trial of an effect whose score may be chance, in a list, if its refit is not and passes."""
    trial = Trial(effect, refitted, chance_of(refitted, effect))
    if trial.p_value > ALPHA / len(library):
        _tell_why(selection, effect, "its relation to the residual may be chance")
        return []
    return passing(selection, trial)


def to_score(selection: Selection, library: Sequence[Effect]) -> list[Effect]:
    """Effects that are not in, and more members of those that are; nothing where nothing is looked for."""
    if not library:
        return []
    spec, motion = selection.fit.model.spec, selection.fit.model.recording.motion
    inside = {effect.name for effect in spec.effects}
    found: list[Effect] = []
    for effect in library:
        if effect.name in inside:
            continue
        covering = [e.title.lower() for e in spec.effects if effect.name in e.absorbs]
        if covering:
            _tell_why(selection, effect, f"is a special case of {covering[0]}, which is in")
        elif reason := effect.missing(motion):
            _tell_why(selection, effect, f"not testable: {reason}")
        else:
            # an arm's gravity is a smooth shape itself, which one with many bends would take in
            found += [effect, *effect.forms(motion)]
            found += [] if spec.gravity == "arm" else _with_more(effect, motion)
    return found + [more for effect in spec.effects for more in effect.larger(motion)]


def _with_more(effect: Effect, motion: Motion) -> list[Effect]:
    """An effect that is a smooth shape with more bends: what the plainest leaves may look like chance where
    it is the rest of that shape. Of lines each is found by itself, in friction too; of lags each element."""
    if effect.is_lag:
        return []
    found, line = [effect], effect.wave(motion)
    if line is not None:
        larger = ((more, more.wave(motion)) for more in effect.larger(motion))
        return [more for more, own in larger if own and own.coordinate == line.coordinate]
    while more := found[-1].larger(motion):
        found.append(more[0])
    return found[1:]


def _candidate(selection: Selection, effect: Effect) -> Candidate:
    """What is kept of an effect; of one without a name nothing is."""
    return selection.candidates.get(effect.name) or Candidate(effect.name)


def _tell_why(selection: Selection, effect: Effect, why: str) -> None:
    candidate = _candidate(selection, effect)
    if not candidate.accepted:
        candidate.why = why


def _accepted(selection: Selection, passed: list[Trial]) -> Trial | None:
    """The simplest of the best, taken in. A fit that was cut short is judged by where it was going, and may
    come to something else: the best has to be it at its end too."""
    ended: list[Trial] = []
    while passed:
        best = simplest_of_best(selection, passed)
        if best in ended:
            accept(selection, best)
            return best
        passed.remove(best)
        full = replace(best, fit=completed(best.fit))
        if lowers(left_out_error(selection.fit), left_out_error(full.fit)):
            passed.append(full)
            ended.append(full)
        else:
            _tell_why(selection, best.effect, "its fit came to no lower left-out error in the end")
    return None


def accept(selection: Selection, winner: Trial) -> None:
    """Take an effect in, its fit being at its end."""
    stays = {effect.name for effect in winner.fit.model.spec.effects}
    for name, candidate in selection.candidates.items():
        if candidate.accepted and name not in stays:
            how = "is a special case of" if name in winner.effect.absorbs else "cannot be beside"
            candidate.accepted, candidate.why = False, f"{how} {winner.effect.name}, which took its place"
            selection.alternatives.pop(name, None)
            selection.p_values.pop(name, None)
    before, selection.fit = left_out_error(selection.fit), winner.fit
    if isinstance(winner.effect, Unnamed):
        selection.nameless[winner.effect.name] = before**2 - left_out_error(winner.fit) ** 2
        return
    candidate = selection.candidates[winner.effect.name]
    if not candidate.accepted:
        candidate.p_value, selection.p_values[winner.effect.name] = winner.p_value, winner.p_value
    candidate.accepted, candidate.why = True, "lowers the error on left-out trials"
    candidate.held_out = left_out_error(winner.fit)


@kept
def completed(fit: JointFit) -> JointFit:
    """A fit that was cut short, to its end."""
    return _with_its_own_load(settle(solve(fit.model, fit.x, bend=fit.bend)))


def _with_its_own_load(fit: JointFit) -> JointFit:
    """The fit with the load that its own gravity puts on the axis: what an effect that was missing did to the
    gravity before it came in must not stay in the load of those that depend on it."""
    model = fit.model
    recording = with_load(model.recording, fit)
    before, now = model.recording.motion.load, recording.motion.load
    if before is None or now is None or np.allclose(before, now, rtol=1e-4, atol=1e-4 * float(np.ptp(now))):
        return fit
    loaded = JointModel.build(recording, model.spec, model.constants)
    nulls = {f"{e.name}.{c.name}": c.null for e in model.spec.effects for c in e.active(recording.motion)}
    gained = {name: null for name, null in nulls.items() if name not in fit.values}
    depends = any("load" in need for effect in model.spec.effects for need in effect.needs)
    if depends or loaded.names != model.names:  # what an effect can show may depend on the load too
        return refit(fit, loaded, gained)
    return replace(fit, model=replace(loaded, starts=model.starts))


def _promising(selection: Selection, scored: list[_Scored]) -> list[_Scored]:
    """Candidates whose score stands out of chance, best gain first."""
    chance = holm({str(place): item.start.p_value for place, item in enumerate(scored)})
    passed = []
    for place, item in enumerate(scored):
        gain = item.start.gain
        if chance[str(place)] > ALPHA:
            _tell_why(selection, item.effect, "its relation to the residual may be chance")
        elif gain < LEAST_GAIN:
            why = f"would lower the squared error by {100 * max(gain, 0.0):.2g} % only"
            _tell_why(selection, item.effect, why)
        else:
            passed.append(item)
    # of two that promise the same but for rounding the simpler comes first
    return sorted(passed, key=lambda item: float(f"{item.left():.9g}"))


def passing(selection: Selection, trial: Trial) -> list[Trial]:
    """The trial, in a list, if it passes. What cannot be beside its effect goes if it passes without."""
    old, new = left_out_error(selection.fit), left_out_error(trial.fit)
    candidate = _candidate(selection, trial.effect)
    if not candidate.accepted:
        candidate.held_out = new
    why = why_not(selection, trial, old, new)
    if why is None and (pushed := pushed_out(selection, trial)):
        for other in pushed:
            if other.name != "inertia":  # every axis has it
                trial = replace(trial, fit=without(trial.fit, other))
        if pushed_out(selection, trial) or why_not(selection, trial, old, left_out_error(trial.fit)):
            why = f"it would stand for {pushed[0].title.lower()}, which then cannot be"
    _tell_why(selection, trial.effect, why or "another effect lowers the left-out error more")
    return [] if why else [trial]


def simplest_of_best(selection: Selection, passed: list[Trial]) -> Trial:
    """The simplest of the trials that predict best, but for chance; the others are noted beside it."""
    errors = [prediction_errors(trial.fit) for trial in passed]
    best = min(errors, key=np.sum)
    tied = [trial for trial, own in zip(passed, errors, strict=True) if own is best or ties(own, best)]
    order = list(selection.candidates)  # the library's order: simplest first; what has no name comes last

    def place(trial: Trial) -> tuple[bool, int, int]:
        name = trial.effect.name
        unnamed = isinstance(trial.effect, Unnamed)
        return unnamed, len(trial.fit.x), len(order) if unnamed else order.index(name)

    winner = min(tied, key=place)
    names = [t.effect.name for t in tied if t is not winner and not isinstance(t.effect, Unnamed)]
    names = [name for name in names if name != winner.effect.name]
    if names and not isinstance(winner.effect, Unnamed):
        selection.alternatives[winner.effect.name] = names
        for name in names:
            selection.candidates[
                name
            ].why = f"explains the data as well as {winner.effect.name}, which is taken"
    return winner
