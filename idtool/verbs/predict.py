"""Predict the torque of logs with a parameter file.

The model is evaluated as it stands. One number per trial and rest comes from the measured torque: the
deflection of the bristle at its start, which nothing else tells.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from idtool.effects import registry
from idtool.errors import InputError, in_file
from idtool.fit.model import LOGARITHMIC, JointModel
from idtool.fit.own_filter import filtered_before
from idtool.fit.spec import FrictionKind, Scales, Spec
from idtool.fit.starts import settled
from idtool.log import Log
from idtool.log.effort import effort_of
from idtool.model import gravity
from idtool.model.motion import Array
from idtool.model.torque import predict as predict_torque
from idtool.model.units import torque_name, unit_suffix, unit_text
from idtool.parameters import GRAVITY_MODELS, Parameters
from idtool.parameters.axis import Axis
from idtool.parameters.correction import Correction
from idtool.presentation.text import counted, listed
from idtool.signals import Recording, record
from idtool.signals.own_filter import OwnFilter

#: An error of more per cent of the torque leaves most of it.
_POOR = 50.0
#: An error of which less than this share is slow enough for a fit to see it is mostly noise.
_MOST = 0.7
#: What stands for nothing where a logarithm is taken, N m (N).
_TINY = 1e-12


@dataclass(frozen=True, repr=False)
class Prediction:
    """Predicted torque of every row.

    Attributes:
        frame: trial, time_s, measured and predicted torque (file column names).
        errors: experiment -> {"rmse", "relative_percent", "rows"}; over all rows.
        notes: sentences on what the parameter file lacks.
        trial: index of every row's trial, running on over the logs, shape (rows,).
        experiment: name of the experiment of each trial.
        unit: of torque and error.
        logs: the files.
        contradictions: sentences on columns that contradict each other, to be read before any number.
        odd: the logs whose columns do.
    """

    frame: pd.DataFrame
    errors: dict[str, dict[str, float]]
    notes: list[str]
    trial: NDArray[np.intp]
    experiment: tuple[str, ...]
    unit: str
    logs: tuple[str, ...] = ()
    contradictions: tuple[str, ...] = ()
    odd: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return "\n".join(self.lines)

    @property
    def lines(self) -> list[str]:
        """The error of each experiment and the notes, as a person reads them."""
        errors = [
            f"{name}: {error['rmse']:.4g} {self.unit} rms, {error['relative_percent']:.3g} % of the torque, "
            f"{error['rows']} rows"
            for name, error in self.errors.items()
        ]
        return [*errors, *(f"note: {note}" for note in self.notes)]

    @property
    def poor(self) -> list[str]:
        """Experiments of which most of the torque is not predicted."""
        return [name for name, error in self.errors.items() if error["relative_percent"] > _POOR]


def predict(logs: Sequence[Log], parameters: Parameters, correction: Correction | None = None) -> Prediction:
    """Predict the torque of every row of the logs.

    Args:
        logs: logs of the axis that the file describes.
        parameters: the file; gravity, friction and effects that it lacks are left out, and said.
        correction: a smooth correction to add.

    Raises:
        InputError: logs of another axis, a file with nothing in it, an effect that needs a column
            that was not logged, or a model that overflows.
    """
    logs = of_axis(logs, parameters)
    if not parameters.static and not parameters.gravity:
        raise InputError(
            "the parameter file holds neither gravity nor friction", remedy="make it with ffc-id identify"
        )
    recording = _loaded(record(logs, every_row=True), parameters)
    # logs that were smoothed as those that were fitted are predicted as they were written
    own = OwnFilter.from_provenance(parameters.provenance)
    if own is not None and filtered_before(recording):
        recording = recording.through(own).without_what_was_before()
    model, x = model_of(recording, parameters)
    model = settled(model, x, model.presliding_scale(x))
    friction, effect = model.friction(x), model.contribution(x)
    start = model.evaluate(x, model.presliding_scale(x)).start
    torque = recording.logged(predict_torque(recording.motion, friction, effect, start).torque)
    if correction is not None:
        torque = torque + correction(recording.motion)
    _refuse_no_number(torque, recording)
    found = Prediction(
        _frame(recording, logs, torque),
        _errors(recording, torque),
        [*_notes(parameters), *_slower(recording, torque), *recording.remarks],
        recording.motion.trial,
        recording.experiment,
        unit_text("torque", recording.axis.units),
        recording.sources,
        tuple(recording.contradictions),
        tuple(recording.odd),
    )
    if found.poor:
        found.notes.append(
            f"most of the torque of {listed(found.poor)} is not predicted: the logs are of another "
            "axis, mounting, payload or unit than what the file was fitted to, or of little but noise."
        )
    return found


def _refuse_no_number(torque: Array, recording: Recording) -> None:
    """A model that overflows on these logs has no answer."""
    bad = np.flatnonzero(~np.isfinite(torque))
    if not len(bad):
        return
    trial = int(recording.motion.trial[bad[0]])
    raise InputError(
        f"the model gives no number on {counted(len(bad), 'row')}",
        file=recording.sources[recording.source[trial]],
        place=f"time_s {recording.motion.time[bad[0]]:.6g}",
        remedy="check the size of the file's parameters, and that they are of this axis",
    )


def explained(logs: Sequence[Log], parameters: Parameters) -> tuple[Recording, Array]:
    """The logs as a fit sees them, and the torque of gravity and effects on every row, without friction.

    Args:
        logs: logs of the axis that the file describes.
        parameters: the file; its friction is not used.

    Returns:
        The recording, and the torque, shape (rows,).

    Raises:
        InputError: logs of another axis, or an effect that needs a column that was not logged.
    """
    recording = loaded(logs, parameters)
    model, x = model_of(recording, parameters)
    torque = model.contribution(x).torque
    return recording, np.broadcast_to(torque, len(recording.motion)).astype(float)


def loaded(logs: Sequence[Log], parameters: Parameters) -> Recording:
    """The logs as a fit sees them, with the load that the file's gravity makes.

    Raises:
        InputError: logs of another axis.
    """
    return _loaded(record(of_axis(logs, parameters)), parameters)


def refuse_other_axis(logs: Sequence[Log], known: Axis) -> None:
    """Refuse logs that are of another axis than a parameter file.

    Raises:
        InputError: it names the log.
    """
    for log in logs:
        if not log.axis.agrees(known):
            raise InputError(
                "is of another axis than the parameter file (kind or torque constant differs)",
                file=log.source,
                place="[axis]",
                remedy="give logs of that axis",
            )


def of_axis(logs: Sequence[Log], parameters: Parameters) -> list[Log]:
    """The logs with what the parameter file knows of their axis (its torque constant, say).

    Raises:
        InputError: logs of another axis.
    """
    known = parameters.axis
    refuse_other_axis(logs, known)
    for log in logs:
        unit = effort_of(log).unit
        if known.effort != "torque" and unit != known.effort:
            raise InputError(
                f"gives a {unit}, and the parameter file is in {unit_text('torque', known.units)} "
                f"({known.effort})",
                file=log.source,
                place="[axis]",
                remedy="give logs of that quantity, or identify the axis from these",
            )
    if known.effort != "torque":
        return list(logs)
    told = []
    for log in logs:
        with in_file(log.source):
            told.append(replace(log, axis=log.axis.completed(known)))
            if (effort := effort_of(told[-1])).unit != "torque":
                raise InputError(
                    f"gives a {effort.unit}, and the parameter file is in {unit_text('torque', known.units)} "
                    "without a constant between the two",
                    place="[axis]",
                    remedy="give the constant with --axis, or identify the axis from these logs",
                )
    return told


def model_of(recording: Recording, parameters: Parameters) -> tuple[JointModel, Array]:
    """The model of a parameter file on a recording, and its coordinates.

    Raises:
        InputError: an effect needs a column that was not logged.
    """
    effects = [registry.get(entry.name) for entry in parameters.effects]
    constants: dict[str, dict[str, float]] = {}
    values: dict[str, float] = {}
    for effect, entry in zip(effects, parameters.effects, strict=True):
        for need in effect.needed(entry.parameters):
            if getattr(recording.motion, need) is None:
                raise InputError(
                    f"the effect {effect.name} needs {need.replace('_', ' ')}, which was not logged",
                    file=recording.sources[0],
                    remedy="log that, or remove the effect from the parameter file",
                )
        # every number of the file is a constant here: nothing is fitted
        constants[effect.name] = effect.from_file(entry.values(), parameters.axis.kind)
    law: FrictionKind = "lugre" if parameters.has_bristle else "stribeck"
    model_name = parameters.gravity_model
    columns = tuple(GRAVITY_MODELS[model_name]) if model_name else ()
    spec = Spec(law, model_name, columns, tuple(effects))
    model = _Fixed(recording, spec, constants)
    values |= {name: p.value for name, p in (parameters.static | parameters.dynamic).items()}
    if not parameters.static:
        scale = Scales.of(recording)
        values |= {"coulomb": _TINY, "static": _TINY, "stribeck_velocity": scale.slowest, "viscous": 0.0}
    values |= {f"gravity.{name}": p.value for name, p in parameters.gravity.items()}
    raw = [
        math.log(max(values[name], _TINY)) if name in LOGARITHMIC else values[name] for name in model.names
    ]
    return model, np.array(raw)


class _Fixed(JointModel):
    """A model whose effects are constants: no coordinate of theirs is free."""

    @property
    def names(self) -> tuple[str, ...]:
        """Coordinates of friction and gravity only."""
        bare = replace(self.spec, effects=())
        return JointModel(self.recording, bare).names


def _loaded(recording: Recording, parameters: Parameters) -> Recording:
    if parameters.gravity_model is None:
        return recording
    coefficients = np.array([parameters.gravity[n].value for n in GRAVITY_MODELS[parameters.gravity_model]])
    motion = recording.motion
    return recording.with_load(
        gravity.columns(parameters.gravity_model, motion) @ coefficients,
        gravity.upright_columns(parameters.gravity_model, motion) @ coefficients,
    )


def _frame(recording: Recording, logs: Sequence[Log], torque: Array) -> pd.DataFrame:
    name = torque_name(recording.axis.units)
    unit = unit_suffix("torque", recording.axis.units)
    measured = f"{name}_{unit}"
    # one log keeps its own trial numbers; several run on
    trial = logs[0].frame["trial"].to_numpy() if len(logs) == 1 else recording.motion.trial
    return pd.DataFrame(
        {
            "trial": trial,
            "time_s": recording.motion.time,
            measured: recording.torque - recording.motion.braking,
            f"{name}_predicted_{unit}": torque - recording.motion.braking,
        }
    )


def _errors(recording: Recording, torque: Array) -> dict[str, dict[str, Any]]:
    names = np.array(recording.experiment)[recording.motion.trial]
    result = {}
    for name in dict.fromkeys(recording.experiment):
        rows = names == name
        left = recording.torque[rows] - torque[rows]
        result[name] = {
            "rmse": float(np.sqrt(np.mean(left**2))),
            "relative_percent": 100.0 * float(np.linalg.norm(left) / np.linalg.norm(recording.torque[rows])),
            "rows": int(rows.sum()),
        }
    return result


def _slower(recording: Recording, torque: Array) -> list[str]:
    """A sentence where most of the error is faster than what a fit compares: noise of each row."""
    left, whole = recording.torque - torque, recording.torque
    every, compared = (
        100.0 * float(np.linalg.norm(error) / np.linalg.norm(size))
        for error, size in ((left, whole), (recording.filtered(left), recording.filtered(whole)))
    )
    if compared > _MOST * every:
        return []
    return [
        f"slower than {recording.filter.bandwidth_hz:.3g} Hz, as a fit compares them, it is {compared:.3g} % "
        f"and {every:.3g} % over all rows: the rest is noise of single rows, mostly of their acceleration."
    ]


def _notes(parameters: Parameters) -> list[str]:
    notes = [f"{parameters.unexplained}."] if parameters.unexplained else []
    notes.append("the bristle's start, one number per trial and rest, was taken from the measured torque.")
    if not parameters.gravity:
        notes.append("the parameter file has no [gravity]: gravity was left out.")
    if not parameters.static:
        notes.append("the parameter file has no [friction.static]: friction was left out.")
    elif not parameters.dynamic:
        notes.append("the parameter file has no [friction.dynamic]: the static curve was used.")
    return notes
