"""A candidate effect: where a search for it should start, its joint refit, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from idtool.diagnosis.evidence import Background, Score, left_out_errors, score
from idtool.diagnosis.lines import strongest_line
from idtool.effects.base import Effect, derivative
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.model.motion import Array
from idtool.model.torque import Direction

#: An effect must lower the left-out error by this share at least: less is not worth a parameter.
LEAST_GAIN = 0.01
#: ... and take away this share of what is above the sensor noise: what only nibbles at the residual of
#: something else is not its explanation.
LEAST_OF_EXCESS = 0.1
#: Evaluations for a candidate's refit: one that has not come near by then is the wrong one.
_SPENT = 20


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
        rivals_at_first: trials that would have done in the first round as well.
        searched: the last fit whose friction curve was searched for anew.
    """

    fit: JointFit
    candidates: dict[str, Candidate]
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    p_values: dict[str, float] = field(default_factory=dict)
    rivals: dict[str, JointFit] = field(default_factory=dict)
    rivals_at_first: list[Trial] = field(default_factory=list)
    searched: JointFit | None = None


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


def try_effect(fit: JointFit, effect: Effect, best: Score, start: dict[str, float], p_value: float) -> Trial:
    model = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
    extra = {f"{effect.name}.{name}": value for name, value in start.items()}
    new = refit(fit, model, extra, most=_SPENT)
    return Trial(effect, new, left_out_errors(new), p_value)


def swap(fit: JointFit, effect: Effect, other: Effect) -> Trial:
    """The fit with `other` in the place of `effect`."""
    without = refit(
        fit, JointModel.build(fit.model.recording, fit.model.spec.without(effect.name), fit.model.constants)
    )
    best, start, tried = best_score(Background.of(without), other)
    return try_effect(without, other, best, start, min(1.0, best.p_value * tried))


def root_mean(errors: Array, fit: JointFit) -> float:
    """Left-out errors as one root mean square over the filtered rows."""
    return float(np.sqrt(errors.sum() / len(fit.residual)))


def implausible(fit: JointFit, effect: Effect) -> str | None:
    """Why the fitted values cannot be that effect, as a sentence; None if they can."""
    return effect.implausible(fit.model.effect_values(fit.x, effect), fit.values)


def ties(one: Array, other: Array) -> bool:
    """Whether left-out errors of two models differ by less than chance and by less than matters."""
    difference = one - other
    chance = float(np.std(difference, ddof=1)) * np.sqrt(len(difference)) if len(difference) > 1 else 0.0
    total = min(float(one.sum()), float(other.sum()))
    return (
        abs(float(difference.sum())) < max(2.0 * chance, LEAST_GAIN * total)
        and abs(float(difference.sum())) < 4.0 * LEAST_GAIN * total
    )
