"""Second thoughts on accepted effects: what became unneeded, what a special case does as well, and what
explains the data as well in its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from idtool.diagnosis.candidates import (
    LEAST_GAIN,
    best_start,
    chance_beside,
    model_without,
    swap,
    ties,
    try_effect,
    without,
)
from idtool.diagnosis.evidence import chance_of
from idtool.diagnosis.plausible import CHANCE, impossible, worth_beside
from idtool.diagnosis.residual import columns_followed
from idtool.diagnosis.shapes import UNNAMED, Unnamed
from idtool.diagnosis.sliding import OF_PRESLIDING, of_presliding
from idtool.diagnosis.state import Selection
from idtool.effects.base import Effect, usual_speed
from idtool.fit.basis import orthonormal
from idtool.fit.joint import JointFit
from idtool.fit.left_out import SURELY, left_out_error, prediction_errors
from idtool.model.motion import Array

#: Mean squares of prediction closer than this share of what is left behind the fit's filter are the same:
#: of the noise that it takes off no model tells, and all that are compared have it.
_THE_SAME = 2e-3
#: Standard errors over blocks within which held-out rows contradict nothing.
_CLEAR = 2.0
#: Held-out rows on which an effect changes less than this share of what left-out trials gain by it (mean
#: squares) have no say on it: that is a third of its torque.
_SHOWN = 0.1
#: An arm's load is a function of its position: one variable.
_OF_AN_ARM = frozenset({"position", "load"})
#: Evaluations for a model that lacks an effect.
_SPENT = 12


def drop_unneeded(selection: Selection, tell: Callable[[str], None]) -> list[Effect]:
    """Drop what no longer lowers the left-out error, least needed first; what was dropped."""
    dropped: list[Effect] = []
    while True:
        fit = selection.fit
        least = left_out_error(fit)
        unneeded: list[tuple[float, Effect, JointFit, str | None]] = []
        for effect in fit.model.spec.effects:
            if effect.name == "inertia":
                continue
            tell(f"trying without {effect.title.lower()}")
            cannot_be = impossible(fit, effect)
            if not cannot_be and least_without(fit, effect) > SURELY * least:
                continue
            smaller = without(fit, effect)
            new = left_out_error(smaller)
            if not cannot_be and of_presliding(smaller, fit, effect):
                cannot_be = OF_PRESLIDING
            if cannot_be or new <= (1.0 + LEAST_GAIN) * least:
                unneeded.append((new, effect, smaller, cannot_be))
        if not unneeded:
            return dropped
        _, effect, smaller, cannot_be = min(unneeded, key=lambda item: item[0])
        dropped.append(effect)
        drop(selection, effect, smaller, cannot_be or "became unneeded when other effects were in")


def drop_impossible(selection: Selection, fit: JointFit) -> list[Effect]:
    """Drop the first effect that the values of a fit cannot be, or that no such data can show, though it may
    have stood for something that is there; what was dropped."""
    for effect in fit.model.spec.effects:
        if effect.name != "inertia" and (why := impossible(fit, effect) or _at_one_speed(fit, effect)):
            drop(selection, effect, without(selection.fit, effect), why)
            return [effect]
    return []


def _at_one_speed(fit: JointFit, effect: Effect) -> str | None:
    """Why a curve of friction over the speed is none that was seen; None if it was."""
    if not effect.of_sliding or usual_speed(fit.model.recording.motion.velocity) is None:
        return None
    return "hardly another speed was moved: log several"


def drop_what_may_be_unknown(selection: Selection, fit: JointFit, depends_on: Sequence[str]) -> list[Effect]:
    """Drop the least sure of the effects that something unknown, which shows in another variable than theirs,
    may be all of; what was dropped. In a variable of its own an effect names what is known of what is there,
    and one without which the left-out trials would be predicted much worse is kept for what it predicts.

    Args:
        selection: on the training rows.
        fit: its model on all trials.
        depends_on: the variables that the structure in that fit's residual follows.
    """
    found: list[tuple[float, str, Effect]] = []
    arm = _OF_AN_ARM if fit.model.spec.gravity == "arm" else frozenset()
    for name in depends_on:
        columns = columns_followed(fit, [name])
        alike = arm if name in arm else {name}
        for effect in fit.model.spec.effects:
            if effect.name == "inertia" or alike & set(effect.follows) or of_the_readings(fit, effect):
                continue
            if (chance := chance_of(fit, effect, beside=columns)) > CHANCE:
                found.append((chance, name, effect))
    for _, name, unsure in sorted(found, key=lambda item: -item[0]):
        smaller = without(selection.fit, unsure)
        if left_out_error(smaller) <= SURELY * left_out_error(selection.fit):
            drop(selection, unsure, smaller, f"may be part of what is left, which depends on {name}")
            return [unsure]
    return []


def veto(
    selection: Selection,
    held_out: Callable[[JointFit], Array],
    between: Callable[[JointFit, JointFit], float],
    tell: Callable[[str], None],
) -> list[Effect]:
    """Take out the effects that cannot be, and those that make the prediction of the held-out rows worse, the
    worst first. One that the left-out trials surely need stays where the held-out rows do not contradict it:
    where, but for chance over blocks, its gain there may be what they promise, or where it hardly shows (a
    load in the middle is predicted without what depends on the load as well).

    Args:
        selection: on the training rows.
        held_out: the mean square on the held-out rows, block by block, shape (blocks,).
        between: the mean square by which the predictions of two models differ there.
        tell: as in `extend`.

    Returns:
        Those.
    """
    vetoed: list[Effect] = []
    while True:
        if gone := drop_impossible(selection, selection.fit):
            vetoed += gone
            continue
        fit = selection.fit
        now, least = held_out(fit), left_out_error(fit)
        found: list[tuple[float, Effect, JointFit]] = []
        for effect in fit.model.spec.effects:
            if effect.name == "inertia" or of_the_readings(fit, effect):
                continue  # when the readings were taken is nothing that a prediction has to earn
            tell(f"predicting without {effect.title.lower()}")
            smaller = without(fit, effect)
            gain, lacking = held_out(smaller) - now, left_out_error(smaller)
            chance = float(np.std(gain) / np.sqrt(len(gain)))
            promised = lacking**2 - least**2
            kept = lacking > SURELY * least and (
                gain.mean() + _CLEAR * chance > promised or between(fit, smaller) < _SHOWN * promised
            )
            if not kept:
                found.append((float(gain.mean()), effect, smaller))
        found = [item for item in found if item[0] <= _THE_SAME * fit.rmse**2]
        if not found:
            return vetoed
        gained, effect, smaller = min(found, key=lambda item: item[0])
        vetoed.append(effect)
        with_it, alone = (np.sqrt(now.mean() + more) for more in (0.0, gained))
        drop(
            selection,
            effect,
            smaller,
            f"held-out trials are predicted no better with it: {with_it:.4g} against {alone:.4g}",
        )


def one_for_many(selection: Selection, tell: Callable[[str], None]) -> bool:
    """Put one local shape in the place of effects of the same variable if it does as well with fewer numbers;
    whether it did. Lines and bends enough follow any bump, one after another."""
    motion = selection.fit.model.recording.motion
    for shape in UNNAMED:
        fit = selection.fit
        inside = [e for e in fit.model.spec.effects if not e.is_lag and set(e.follows) & set(shape.follows)]
        alike = [e for e in inside if not isinstance(e, Unnamed)]
        numbers = sum(len(e.active(motion)) for e in alike)
        if shape in inside or len(shape.coordinates) >= numbers or shape.missing(motion):
            continue
        tell(f"trying {shape.title.lower()} in place of {', '.join(e.title.lower() for e in alike)}")
        lacking = without(fit, *alike)
        trial = try_effect(lacking, shape, best_start(lacking, shape), far=True)
        if left_out_error(trial.fit) > (1.0 + LEAST_GAIN) * left_out_error(fit):
            continue
        selection.nameless[shape.name] = left_out_error(lacking) ** 2 - left_out_error(trial.fit) ** 2
        for effect in alike:
            drop(selection, effect, trial.fit, f"{shape.title.lower()} does as well")
        return True
    return False


def least_without(fit: JointFit, effect: Effect) -> float:
    """Root-mean-square residual without an effect, the rest making up for it in proportion: no refit."""
    model = model_without(fit, effect)
    x = model.coordinates({name: fit.values[name] for name in model.names})
    alone = model.evaluate(x, fit.bend).residual
    own = np.array([name.startswith(f"{effect.name}.") for name in fit.model.names])
    rest = fit.jacobian[: len(alone), fit.free & ~own]
    basis = orthonormal(rest)
    return float(np.sqrt(np.mean((alone - basis @ (basis.T @ alone)) ** 2)))


def of_the_readings(fit: JointFit, effect: Effect) -> str | None:
    """Why what an effect stands for is of the readings, not of the axis; None if it is of the axis."""
    return effect.of_the_readings(fit.model.effect_values(fit.x, effect), fit.model.recording.motion)


def drop(selection: Selection, effect: Effect, smaller: JointFit, why: str) -> None:
    """Take an effect out; `smaller` is the fit without it."""
    selection.fit = smaller
    if effect.name in selection.candidates:
        candidate = selection.candidates[effect.name]
        candidate.accepted, candidate.why = False, why
        selection.alternatives.pop(effect.name, None)
        selection.p_values.pop(effect.name, None)


def simplify(
    selection: Selection,
    library: Sequence[Effect],
    tell: Callable[[str], None],
    shown_by: JointFit | None = None,
) -> bool:
    """Put a special case in the place of an accepted effect wherever it does as well, or lacks next to
    nothing, or what may be chance; whether any was.

    Args:
        selection: on the training rows.
        library: the special cases that there are.
        tell: as in `extend`.
        shown_by: the fit that tells, of the same model on other rows; that of the selection if None.
    """
    by_name = {effect.name: effect for effect in library}
    changed = False
    for effect in selection.fit.model.spec.effects:
        for name in effect.absorbs:
            if name not in by_name or by_name[name].missing(selection.fit.model.recording.motion):
                continue
            tell(f"trying {name} in place of {effect.name}")
            fit = shown_by or selection.fit
            swapped = swap(fit, effect, by_name[name])
            before, after = left_out_error(fit), left_out_error(swapped.fit)
            if (
                after > (1.0 + LEAST_GAIN) * before
                and worth_beside(fit, swapped.fit)
                and chance_beside(fit, effect, by_name[name], without(fit, effect)) <= CHANCE
            ):
                continue
            if shown_by is not None:
                swapped = swap(selection.fit, effect, by_name[name])
            selection.fit, changed = swapped.fit, True
            loser, winner = selection.candidates[effect.name], selection.candidates[name]
            loser.accepted, loser.why = False, f"its special case {name} does as well"
            winner.accepted, winner.why = True, "lowers the error on left-out trials"
            winner.held_out = left_out_error(swapped.fit)
            selection.p_values[name] = selection.p_values.pop(effect.name, swapped.p_value)
            selection.alternatives.pop(effect.name, None)
            break
    return changed


def find_alternatives(selection: Selection, library: Sequence[Effect], tell: Callable[[str], None]) -> None:
    """For each accepted effect, the equally simple ones that explain the data as well in its place.

    Candidates are those that tied when it was accepted, and its known look-alikes. Inertia, which every
    axis has, is not put in question.
    """
    by_name = {effect.name: effect for effect in library}
    fit = selection.fit
    motion = fit.model.recording.motion
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
            swapped = swap(fit, effect, other)
            if len(swapped.fit.x) == len(fit.x) and ties(
                prediction_errors(swapped.fit), prediction_errors(fit)
            ):
                found.setdefault(effect.name, []).append(name)
                selection.rivals.setdefault(effect.name, swapped.fit)
                selection.candidates[name].why = f"explains the data as well as {effect.name}, which is taken"
    selection.alternatives = found
