"""The next experiment: of a family of runs within what the axis has been seen to do, the one that tells most.

Two fitted models that tie are told apart by the run on which they differ most after the second has done
its best to follow the first (T-optimality: Hunter & Reiner 1965, Atkinson & Fedorov 1975), as far as the
data at hand leave it free to. A parameter that the data do not determine is found by the run that leaves
it the smallest standard error (c-optimality). Both are computed from the fits linearised.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from idtool.diagnosis.possible_runs import STEP_S, possible_runs
from idtool.experiment.recipe import Recipe
from idtool.fit.choose import with_load
from idtool.fit.joint import JointFit
from idtool.fit.model import JointModel
from idtool.model.motion import Array, Motion
from idtool.model.torque import linearise
from idtool.presentation.text import quantity
from idtool.signals import Recording

#: Two models are told apart by this many standard errors; less is not worth a run.
_WORTH = 4.0
#: A run must leave a parameter at most this share of its standard error.
_BETTER = 0.5


@dataclass(frozen=True)
class NextExperiment:
    """A run to make next.

    Attributes:
        recipe: as a TOML document.
        separates: the effects that it tells apart; empty where it is for a parameter.
        why: a sentence.
    """

    recipe: dict[str, Any]
    separates: tuple[str, ...]
    why: str

    def to_document(self) -> dict[str, Any]:
        """As in diagnosis.json."""
        return {"recipe": self.recipe, "separates": list(self.separates), "why": self.why}


def between_models(one: JointFit, other: JointFit, names: tuple[str, ...]) -> NextExperiment | None:
    """The run that best tells two fitted models apart, as `names` of their effects; None if no run of the
    family does."""
    best: tuple[float, dict[str, Any], Recipe] | None = None
    for document, recipe in possible_runs(one.model.recording):
        told = _difference(one, other, recipe)
        if best is None or told > best[0]:
            best = told, document, recipe
    if best is None or best[0] < _WORTH:
        return None
    told, document, recipe = best
    why = (
        f"{' and '.join(names)} explain these logs equally well; on this run of {recipe.duration_s:.0f} s "
        f"they differ by {told:.0f} standard errors."
    )
    return NextExperiment(document, names, why)


def for_parameter(fit: JointFit, coordinate: str) -> NextExperiment | None:
    """The run that best determines one coordinate of a fit, or None if no run of the family does."""
    if coordinate not in fit.model.names:
        return None
    at = fit.model.names.index(coordinate)
    known = _information(fit)
    now = _spread(known, at)
    best: tuple[float, dict[str, Any], Recipe] | None = None
    for document, recipe in possible_runs(fit.model.recording):
        _, jacobian, weight = _model_on(fit, recipe)
        share = _spread(known + weight * jacobian.T @ jacobian, at) / now
        if best is None or share < best[0]:
            best = share, document, recipe
    if best is None or best[0] > _BETTER:
        return None
    share, document, recipe = best
    name = quantity(coordinate).replace(".", ": ")
    why = (
        f"{name} is not determined by these logs; this run of {recipe.duration_s:.0f} s "
        f"would make its standard error {_times(share)} smaller."
    )
    return NextExperiment(document, (), why)


def _times(share: float) -> str:
    return "over 100 times" if share < 0.01 else f"about {1.0 / share:.2g} times"


def _difference(one: JointFit, other: JointFit, recipe: Recipe) -> float:
    """By how many standard errors two models differ on a run, the other one free to follow the first as far
    as the data at hand let it."""
    first, _, _ = _model_on(one, recipe)
    second, jacobian, weight = _model_on(other, recipe)
    gap = first - second
    inside = _information(other) + weight * jacobian.T @ jacobian
    along = jacobian.T @ gap
    left = weight * float(gap @ gap) - weight**2 * float(
        along @ np.linalg.lstsq(inside, along, rcond=1e-12)[0]
    )
    return math.sqrt(max(left, 0.0))


def _information(fit: JointFit) -> Array:
    """Inverse covariance of a fit's coordinates from the data at hand; nothing known where none is."""
    covariance = fit.covariance
    sd = np.sqrt(np.diag(covariance))
    free = sd > 0
    scaled = covariance[np.ix_(free, free)] / np.outer(sd[free], sd[free])
    information = np.zeros_like(covariance)
    inverse = np.linalg.pinv(scaled, rcond=1e-10, hermitian=True)
    information[np.ix_(free, free)] = inverse / np.outer(sd[free], sd[free])
    return information


def _spread(information: Array, at: int) -> float:
    """Standard error of one coordinate."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-12, hermitian=True)
    variance = float(inverse[at, at]) / float(scale[at]) ** 2
    return math.sqrt(variance) if variance > 0 else math.inf


def _model_on(fit: JointFit, recipe: Recipe) -> tuple[Array, Array, float]:
    """Torque of a fitted model on a run, its derivatives, and one over the variance of a row.

    The start deflection of each trial is unknown there too: what it can do is taken out of both.
    """
    recording = with_load(_recording_of(recipe, fit.model.recording), fit)
    motion = recording.motion
    model = JointModel(recording, fit.model.spec, fit.model.constants, coordinates_from=fit.model.recording)
    start = np.zeros(motion.stretches)
    prediction, derivatives = linearise(
        motion, model.friction(fit.x), model.contribution(fit.x), start, model.directions(fit.x)
    )
    column = prediction.start_column
    norm = np.bincount(motion.trial, column**2) + 1e-12

    def free(values: Array) -> Array:
        share = np.bincount(motion.trial, column * values) / norm
        return np.asarray(values - column * share[motion.trial])

    # correlated rows count as the fewer that they are worth: the spectrum of the residual is that of a row
    worth = recording.noise**2 * max(fit.rmse / fit.model.filtered_noise, 1.0) ** 2
    torque = free(prediction.torque)
    columns = np.column_stack([free(c) for c in derivatives])
    return torque, columns, 1.0 / worth


def _recording_of(recipe: Recipe, known: Recording) -> Recording:
    """What a run would record if the axis follows its commands, about the middle of where it was seen."""
    middle = float(np.median(known.motion.position))
    clock = float(known.motion.time.max()) + 10.0
    time, label, position, velocity, payload, tilt = [], [], [], [], [], []
    for number, trial in enumerate(recipe.trials):
        command = trial.motion.command(STEP_S)
        travel = STEP_S * np.cumsum(command)
        n = len(command)
        time.append(clock + STEP_S * np.arange(n))
        label.append(np.full(n, number, dtype=np.intp))
        position.append(middle + travel - 0.5 * (travel.max() + travel.min()))
        velocity.append(command)
        payload.append(np.full(n, trial.setup.payload_kg))
        tilt.append(np.full(n, trial.setup.tilt_alpha_rad))
        clock += n * STEP_S + 2.0
    seen, rows = known.motion, sum(map(len, time))
    alpha, speed = np.concatenate(tilt), np.concatenate(velocity)
    beta = 0.0 if seen.tilt_beta is None else float(np.median(seen.tilt_beta))
    motion = Motion(
        time=np.concatenate(time),
        trial=np.concatenate(label),
        position=np.concatenate(position),
        velocity=speed,
        acceleration=np.asarray(np.gradient(speed, STEP_S)),
        payload=None if seen.payload is None else np.concatenate(payload),
        gravity_factor=None if seen.gravity_factor is None else np.cos(alpha) * math.cos(beta),
        tilt_alpha=None if seen.tilt_alpha is None else alpha,
        tilt_beta=None if seen.tilt_beta is None else np.full(rows, beta),
        temperature=None if seen.temperature is None else np.full(rows, float(seen.temperature[-1])),
        torque_constant=seen.torque_constant,
    )
    return replace(
        known,
        motion=motion,
        torque=np.zeros(rows),
        usable=np.ones(rows, dtype=bool),
        experiment=("next",) * len(recipe.trials),
        source=(0,) * len(recipe.trials),
    )
