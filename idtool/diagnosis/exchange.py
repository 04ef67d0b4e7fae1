"""Second thoughts on the order in which effects came in: others in the place of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from idtool.diagnosis.candidates import Start, best_start, ties, try_effect, without
from idtool.diagnosis.pruning import drop
from idtool.diagnosis.selection import (
    ALPHA,
    BEHIND,
    accept,
    completed,
    one_by_one,
    passing,
    simplest_of_best,
    to_score,
)
from idtool.diagnosis.shapes import Unnamed
from idtool.diagnosis.sliding import doubtful
from idtool.diagnosis.state import Selection, Trial
from idtool.effects.base import Effect
from idtool.fit.joint import JointFit
from idtool.fit.left_out import left_out_error, prediction_errors
from idtool.fit.restart import worth_a_restart

#: Effects that are tried in the place of one.
_EXCHANGED = 2
#: Effects that one lag may stand for.
_FOR_A_LAG = 2


def exchange(
    selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]
) -> Selection | None:
    """The selection with others in the place of an effect that came in while they were missing, where that
    predicts better, or as well with fewer numbers (sequential replacement: Miller, Subset Selection in
    Regression, 2002, ch. 3); None where nothing does. One lag can stand for two others, so that for a lag
    the search goes on without it, among lags."""
    fit = selection.fit
    if not worth_a_restart(fit):
        return None
    better: list[tuple[Effect, Selection, Trial]] = []
    for effect in fit.model.spec.effects:
        if effect.name == "inertia" or isinstance(effect, Unnamed):
            continue
        if effect.is_lag and (found := _without_lag(selection, effect, library, tell)):
            return found
        lacking = Selection(without(fit, effect), {})
        for other, start in _promising(lacking, fit, effect, library):
            tell(f"trying {other.title.lower()} in place of {effect.title.lower()}")
            trial = try_effect(lacking.fit, other, start, far=True)
            if in_its_place(trial.fit, fit) and passing(lacking, trial):
                better.append((effect, lacking, trial))
    while better:
        best = simplest_of_best(selection, [trial for *_, trial in better])
        effect, lacking, trial = next(one for one in better if one[2] is best)
        better.remove((effect, lacking, trial))
        full = completed(trial.fit)
        if in_its_place(full, fit):
            found = selection.copy()
            drop(found, effect, lacking.fit, f"{trial.effect.title.lower()} does better in its place")
            accept(found, replace(trial, fit=full))
            return found
    return None


def _promising(
    lacking: Selection, fit: JointFit, effect: Effect, library: Sequence[Effect]
) -> list[tuple[Effect, Start]]:
    """The surest few that may come in where an effect is gone, of those whose scores leave not much more."""
    others = (other for other in to_score(lacking, library) if other.name != effect.name)
    found = [
        (other, start)
        for other in others
        if (start := best_start(lacking.fit, other)).columns is not None
        and start.p_value < ALPHA / len(library)
        and (1.0 - start.gain) * lacking.fit.sse < BEHIND * fit.sse
    ]
    return sorted(found, key=lambda one: one[1].p_value)[:_EXCHANGED]


def _without_lag(
    selection: Selection, lag: Effect, library: Sequence[Effect], tell: Callable[[str], None]
) -> Selection | None:
    """What other lags come to in the place of one, if that is clearly better."""
    tell(f"looking for what {lag.title.lower()} may stand for")
    other = selection.copy()
    drop(other, lag, without(selection.fit, lag), "others do better in its place")
    others = [effect for effect in library if effect.is_lag and effect.name != lag.name]
    one_by_one(other, others, tell, given=True, rounds=_FOR_A_LAG)
    return other if _clearly_better(other.fit, selection.fit) else None


def in_its_place(one: JointFit, other: JointFit) -> bool:
    """Whether a model with another effect is clearly better, or as good with fewer numbers."""
    tied = ties(prediction_errors(one), prediction_errors(other))
    return len(one.x) < len(other.x) if tied else _clearly_better(one, other)


def _clearly_better(one: JointFit, other: JointFit) -> bool:
    if ties(prediction_errors(one), prediction_errors(other)):
        return False
    return left_out_error(one) < left_out_error(other) and not doubtful(one, other)
