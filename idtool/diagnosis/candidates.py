"""A candidate effect: where a search for it should start, and its joint refit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from idtool.diagnosis.evidence import Background, Score, background_of, chance_of, score
from idtool.diagnosis.lines import strongest_line, waves_of
from idtool.diagnosis.repetition import beats_with_motion
from idtool.diagnosis.residual import motion_columns
from idtool.diagnosis.shapes import Unnamed
from idtool.diagnosis.state import Trial
from idtool.diagnosis.summed import HIDDEN, Summed
from idtool.effects.base import Coordinate, Effect, derivative
from idtool.fit.joint import JointFit, kept, refit
from idtool.fit.model import JointModel
from idtool.model.contribution import Contribution
from idtool.model.motion import Array
from idtool.model.torque import Direction
from idtool.signals import Recording

#: An effect must lower the left-out error by this share at least: less is not worth a parameter.
LEAST_GAIN = 0.01
#: Highest frequency that filtered rows show, as a share of their rate.
_NYQUIST = 0.45
#: What beats from outside has no regard for the motion: a wave of which the motion explains more than half
#: may be the motion's own.
_APART = 0.5
#: A start without a linear strength is one of about the right size if its residual asks for so much of it.
_OF_ITS_SIZE = (0.2, 5.0)
#: How far around the best place and width of a local shape is looked next, as shares of its width.
_CLOSER = (1.0, 0.5, 0.25, 0.12)
#: Evaluations for a candidate's refit: one that has not come near by then is the wrong one.
_SPENT = 15
#: ... that screen its starts where it has several, and of how many scores.
_SCREEN = 12
_MOST_STARTS = 3
_SPENT_FAR = 40
#: Share of the sum of squares that a comparison of models does not need: a hundredth of what decides.
NEAR = 1e-4


@dataclass(frozen=True, eq=False)
class Start:
    """Where a refit with an effect should start.

    Attributes:
        gain: share of the residual's squares that its score promises to take away.
        p_value: of that being chance, corrected for the starts that were tried.
        values: coordinates of the effect.
        others: those of the next best starts.
        columns: what its strengths do to the residual, shape (filtered rows + trials, n); None of what was
            scored otherwise, or not at all.
        tried: how many starts it is the best of.
    """

    gain: float
    p_value: float
    values: dict[str, float]
    others: tuple[dict[str, float], ...] = ()
    columns: Array | None = None
    tried: int = 1


@kept
def best_start(fit: JointFit, effect: Effect) -> Start:
    """The best start of an effect.

    An effect that is in the model already, with fewer members, is scored by what the new ones add. What beats
    in time is scored by what no smooth function of the motion does, since a motion that repeats beats too.
    """
    background = background_of(fit)
    if isinstance(effect, Unnamed):
        return _best_shape(fit, effect)
    model = fit.model
    motion = model.recording.motion
    has = {name.partition(".")[2] for name in model.names if name.startswith(f"{effect.name}.")}
    coordinates = [c for c in effect.active(motion) if c.name not in has]
    nothing = {c.name: c.null for c in coordinates}
    null = {**effect.constants(motion), **nothing}
    if has:
        known = next(e for e in model.spec.effects if e.name == effect.name)
        null |= model.effect_values(fit.x, known)
    starts = [*effect.starts(motion), *([] if has else effect.sizes(motion))]
    starts = [start for start in starts if not set(start) & has] or [{}]
    tried = len(starts)
    wave = effect.wave(motion)
    whole = float(background.residual @ background.residual)
    if "time" in effect.follows and wave is not None:
        background = background.beside(motion_columns(fit))
    if wave is not None and wave.coordinate not in has:
        highest = wave.highest
        if "time" in effect.follows:  # above that a line of the filtered rows is the alias of another
            highest = min(highest, _NYQUIST * model.recording.filter.rate_hz)
        size = _more_friction(fit) if wave.of_friction else 1.0
        of = wave.of[model.recording.row]
        part = None if wave.part is None else wave.part[model.recording.row]
        frequency, tried = strongest_line(background, of, wave.lowest, highest, size, part)
        starts = [{wave.coordinate: frequency}]
        if "time" in effect.follows and (
            _own_share(background, waves_of(frequency * of, part=part)) < _APART
            or beats_with_motion(motion, frequency)
        ):
            return Start(0.0, 1.0, nothing | starts[0])
    best: tuple[Score, dict[str, float]] | None = None
    others: list[tuple[float, dict[str, float]]] = []
    for start in starts:
        strengths = [c for c in coordinates if c.name not in start]
        values = {**null, **start}
        if strengths:
            again = wave is None and not has  # the same ones, whatever the fit is
            directions = [_unit(model.recording, effect, values, c, again) for c in strengths]
            columns = model.project(fit.x, fit.bend, fit.start, directions)
        else:
            columns = np.append(added(fit, effect, values), np.zeros(len(fit.start)))[:, None]
        result = score(background, columns)
        found = {**start}
        if not strengths and not _OF_ITS_SIZE[0] < result.step[0] < _OF_ITS_SIZE[1]:
            continue
        # what the effect cannot do (a strength below zero) does not count for it
        steps = dict(zip((c.name for c in strengths), result.step, strict=False))
        able = [c.lower <= values[c.name] + steps[c.name] <= c.upper for c in strengths]
        if not all(able):
            result = score(background, columns * np.array(able))
            steps = dict(zip((c.name for c in strengths), result.step, strict=True))
        for c in strengths:
            found[c.name] = float(np.clip(values[c.name] + steps[c.name], c.lower, c.upper))
        others.append((result.gain, found))
        if best is None or result.gain > best[0].gain:
            best = (result, found)
    if best is None:
        return Start(0.0, 1.0, nothing | starts[0])
    chance = background.chance(best[0].left, best[0].columns)
    share = float(background.residual @ background.residual) / whole
    ranked = [found for _, found in sorted(others, key=lambda one: -one[0])]
    p_value, gain = min(1.0, chance * tried), best[0].gain * share
    return Start(gain, p_value, best[1], tuple(ranked[1:_MOST_STARTS]), best[0].columns, tried)


def _unit(
    recording: Recording, effect: Effect, values: Mapping[str, float], coordinate: Coordinate, again: bool
) -> Direction:
    """What one unit of a coordinate of an effect adds, kept if it is asked for `again`."""
    if not again:
        return Direction(effect=derivative(effect, recording.motion, values, coordinate))
    key = effect, coordinate.name, tuple(sorted(values.items()))
    unit = recording.once(key, lambda: derivative(effect, recording.motion, values, coordinate))
    return Direction(effect=unit, origin=(key, ()))


def _own_share(background: Background, waves: Array) -> float:
    """How much of waves is free of what a background can explain, as a share of their size."""
    waves = np.vstack([waves, np.zeros((len(background.basis) - len(waves), waves.shape[1]))])
    return float(np.linalg.norm(background.free_of_fit(waves)) / np.linalg.norm(waves))


def added(fit: JointFit, effect: Effect, values: Mapping[str, float]) -> Array:
    """What an effect of given size adds to the filtered torque of a fit, shape (filtered rows,)."""
    model = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
    return fit.residual - _residual_at(fit, model, _named(effect, values))


def _residual_at(fit: JointFit, model: JointModel, extra: Mapping[str, float]) -> Array:
    """Residual of another model whose parameters are those of a fit, and `extra`."""
    known = {**fit.values, **extra}
    x = model.coordinates({name: known[name] for name in model.names})
    return model.evaluate(x, fit.bend).residual


def _named(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """Values of an effect by their names in a model."""
    return {f"{effect.name}.{name}": value for name, value in values.items()}


def _best_shape(fit: JointFit, effect: Unnamed) -> Start:
    """All places and widths of a local shape at once, then closer and closer around the best: rows are close
    enough to the filtered ones for that."""
    background, recording = background_of(fit), fit.model.recording
    motion, row = recording.motion, recording.row
    turned = _more_friction(fit) if effect.of_friction else np.ones(len(row))
    variable = effect.variable(motion)[row]
    residual, basis = background.residual[: len(row)], background.basis[: len(row)]
    starts = effect.starts(motion)
    tried = len(starts)
    summed = Summed.of(variable, turned, residual, basis)
    for share in (*_CLOSER, 0.0):
        columns = [effect.shape(summed.variable, s["place"], s["log_width"]) for s in starts]
        best = int(np.argmax(summed.gains(np.column_stack(columns))))
        if share:
            starts = effect.near(motion, starts[best], share)
    column = turned * effect.shape(variable, starts[best]["place"], starts[best]["log_width"])
    shape = column - basis @ (basis.T @ column)
    norm = float(shape @ shape)
    height = float(shape @ residual) / norm if norm > HIDDEN * float(column @ column) else 0.0
    left = residual - height * shape
    gain = 1.0 - float(left @ left) / float(residual @ residual)
    chance = background.chance(left, shape[:, None])
    found = {**starts[best], "height": height}
    return Start(max(gain, 0.0), min(1.0, chance * tried), found)


@kept
def _more_friction(fit: JointFit) -> Array:
    """What a friction level that is higher by one adds to the torque, shape (filtered rows,)."""
    higher = Direction(effect=Contribution(level_torque=1.0))
    column = fit.model.project(fit.x, fit.bend, fit.start, [higher])
    return np.asarray(column[: len(fit.residual), 0])


@kept
def try_effect(fit: JointFit, effect: Effect, start: Start, *, far: bool = False) -> Trial:
    """The joint refit with an effect, or with more members of one; `far` from where it will end."""
    model = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
    most = _SPENT_FAR if far else _SPENT
    scored = (start.values, *start.others)
    begun = [_within_reach(fit, model, effect, start.values)]
    for one in scored:
        more = [_named(effect, values) for values in effect.also_from(one, fit.values)]
        begun += [values for values in more if values not in begun]
    if len(begun) > 1:
        screened = [refit(fit, model, one, most=_SCREEN, tolerance=NEAR, settling=0) for one in begun]
        begun = [min(screened, key=lambda one: one.sse).values]
    new = refit(fit, model, begun[0], most=most, tolerance=NEAR)
    values, motion = new.model.effect_values(new.x, effect), fit.model.recording.motion
    if plainer := effect.plainer(values, new.values, motion):
        effect, others = plainer
        plain = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
        new = refit(new, plain, others, most=_SPENT, tolerance=NEAR)
    return Trial(effect, new, start.p_value)


def _within_reach(
    fit: JointFit, model: JointModel, effect: Effect, values: Mapping[str, float]
) -> dict[str, float]:
    """The values of an effect by their names in a model; where they make the fit worse, the rest would have
    to move as far as it cannot: from an effect that is not there yet, step by step."""
    extra = _named(effect, values)
    if np.sum(_residual_at(fit, model, extra) ** 2) > fit.sse:
        linear = [c for c in effect.active(model.recording.motion) if c.increment == 1.0]
        none = _named(effect, {c.name: c.null for c in linear})
        extra |= {name: fit.values.get(name, null) for name, null in none.items()}
    return extra


def chance_beside(fit: JointFit, effect: Effect, special: Effect, before: JointFit) -> float:
    """P-value of what an effect that is in a model adds to its special case, which is not.

    Args:
        fit: with the effect.
        effect, special: it and its special case.
        before: without either.
    """
    columns = best_start(before, special).columns
    return chance_of(fit, effect, beside=[] if columns is None else [columns[: len(fit.residual)]])


def swap(fit: JointFit, effect: Effect, other: Effect) -> Trial:
    """The fit with `other` in the place of `effect`: from where the rest is now, or, where that leaves more,
    from where the rest ends without it, which may be far away."""
    found: list[Trial] = []
    for most in (1, 60):
        lacking = without(fit, effect, most=most)
        found.append(try_effect(lacking, other, best_start(lacking, other)))
        if found[-1].fit.sse <= (1.0 + LEAST_GAIN) * fit.sse:
            break
    return min(found, key=lambda trial: trial.fit.sse)


@kept
def without(fit: JointFit, *effects: Effect, most: int = _SPENT) -> JointFit:
    """The refit without some effects, of so many evaluations at most."""
    return refit(fit, model_without(fit, *effects), most=most, tolerance=NEAR)


def model_without(fit: JointFit, *effects: Effect) -> JointModel:
    """The model of a fit without some effects."""
    spec = fit.model.spec
    for effect in effects:
        spec = spec.without(effect.name)
    return JointModel.build(fit.model.recording, spec, fit.model.constants)


def ties(one: Array, other: Array) -> bool:
    """Whether left-out errors of two models differ by less than chance and by less than matters."""
    difference = one - other
    chance = float(np.std(difference, ddof=1)) * np.sqrt(len(difference)) if len(difference) > 1 else 0.0
    total = min(float(one.sum()), float(other.sum()))
    return (
        abs(float(difference.sum())) < max(2.0 * chance, LEAST_GAIN * total)
        and abs(float(difference.sum())) < 4.0 * LEAST_GAIN * total
    )
