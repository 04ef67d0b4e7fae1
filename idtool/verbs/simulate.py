"""Simulate logs forward with a parameter file: the position that the logged effort, or the goal, makes.

    simulation = simulate(logs, Parameters.read("params.toml"))
    simulation.frame            # trial, time_s, position_rad, position_simulated_rad
    simulation.mean_abs         # rad, over all rows

From the effort the identified axis alone is judged; small errors of the torque add up over a trial. From the
goal the servo's own loop (`[drive]`) closes around the axis, as it does on the machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np
import pandas as pd

from idtool.errors import InputError, nearest
from idtool.fit.drive import fit_drive
from idtool.log import Log, columns_of
from idtool.model.motion import Array
from idtool.model.units import is_linear
from idtool.parameters import Parameters
from idtool.parameters.drive import with_loop
from idtool.signals import record
from idtool.signals.lateness import without_late_velocity
from idtool.simulation.plant import PlantFile
from idtool.simulation.stage import WINDOW_S, Source, Stage, measured_position
from idtool.verbs.predict import of_axis

#: A simulated axis that is so many strokes off has run away: small errors of the torque add up to a few.
_AWAY = 100.0


@dataclass(frozen=True)
class TrialError:
    """How far one trial's simulated position is off, rad (m).

    Attributes:
        log: file.
        trial: its number there.
        mean_abs, rms: over the trial, simulated from its first row alone.
        rms_windows: rms over windows of one second, each started from the measured state.
    """

    log: str
    trial: int
    mean_abs: float
    rms: float
    rms_windows: float


@dataclass(frozen=True, repr=False)
class Simulation:
    """Simulated logs.

    Attributes:
        frame: trial, time_s, position measured and simulated (file column names).
        trials: the error of each trial.
        mean_abs, rms, rms_windows: over all rows, see `TrialError`.
        seconds: of motion that were simulated.
        notes: sentences on what was left out or taken from these logs.
        linear: whether positions are metres.
    """

    frame: pd.DataFrame
    trials: tuple[TrialError, ...]
    mean_abs: float
    rms: float
    rms_windows: float
    seconds: float
    notes: tuple[str, ...]
    linear: bool

    def __repr__(self) -> str:
        return "\n".join(self.lines)

    @property
    def lines(self) -> list[str]:
        """The error of each trial and of all, and the notes, as a person reads them."""
        lines = [f"{one.log}, trial {one.trial}: {self._words(one)}" for one in self.trials]
        if len(self.trials) > 1:
            lines.append(f"all: {self._words(self)}")
        return [*lines, *(f"note: {note}" for note in self.notes)]

    @property
    def unit(self) -> str:
        """In which errors are told."""
        return "mm" if self.linear else "mrad"

    def _words(self, one: Simulation | TrialError) -> str:
        return (
            f"{1e3 * one.mean_abs:.4g} {self.unit} mean absolute, {1e3 * one.rms:.4g} rms, "
            f"{1e3 * one.rms_windows:.4g} rms over windows of 1 s"
        )

    def to_document(self) -> dict[str, Any]:
        """What `--json` prints: errors in mrad (mm on a linear axis)."""

        def errors(one: Simulation | TrialError) -> dict[str, float]:
            return {
                f"mean_abs_{self.unit}": 1e3 * one.mean_abs,
                f"rms_{self.unit}": 1e3 * one.rms,
                f"rms_1s_windows_{self.unit}": 1e3 * one.rms_windows,
            }

        trials = [{"log": one.log, "trial": one.trial, **errors(one)} for one in self.trials]
        return {**errors(self), "trials": trials, "seconds": self.seconds, "notes": list(self.notes)}


def simulate(
    log: Log | Sequence[Log],
    parameters: Parameters,
    source: Source = "effort",
    *,
    progress: Callable[[float], None] = lambda _: None,
) -> Simulation:
    """Simulate one log or several.

    Args:
        log: of the axis that the file describes.
        parameters: the file; it needs inertia and static friction.
        source: "effort", or "goal" for the logged goal through the position loop of `[drive]`, which is
            identified from these logs where the file has none.
        progress: called with the share done, 0 to 1.

    Raises:
        InputError: an unknown source, logs of another axis, no inertia, or no goal in a log.
    """
    if source not in get_args(Source):
        raise InputError(
            f"unknown source {source!r}", argument="source", remedy=nearest(source, get_args(Source))
        )
    logs, notes = without_late_velocity(of_axis([log] if isinstance(log, Log) else log, parameters))
    if parameters.unexplained:
        notes = [f"{parameters.unexplained}.", *notes]
    recording = record(logs, every_row=True)
    if source == "goal" and (parameters.drive is None or parameters.drive.position_gain is None):
        parameters = replace(parameters, drive=with_loop(parameters.drive, fit_drive(logs)))
        notes.append("the parameter file has no [drive]: the position loop was identified from these logs.")
    file = PlantFile.of(parameters, recording.motion.torque_constant)
    stage = Stage.of(logs, recording, parameters.drive if source == "goal" else None)
    emf = None if parameters.drive is None else parameters.drive.back_emf
    if emf is not None and not emf.identified and not np.all(stage.driven > 0.0):
        notes.append(
            "rows with the drive off were simulated without any viscous friction: no log of the fit had the "
            "drive off, so nothing told how much of it is back-EMF."
        )
    path = stage.run(file, math.inf, lambda share: progress(0.5 * share))
    again = stage.run(file, WINDOW_S, lambda share: progress(0.5 + 0.5 * share))
    measured = measured_position(logs, recording)
    off, off_again = path - measured, again - measured
    if not np.max(np.abs(off)) < _AWAY * np.ptp(measured):  # nor is what overflowed
        notes.append(
            "the simulated axis runs away from the measured one: at some speed this model drives it instead "
            "of holding it, or the torque is inverted; its positions say nothing."
        )
    motion = recording.motion
    trials = []
    for trial, source_index in enumerate(recording.source):
        rows = motion.trial == trial
        numbers = logs[source_index].frame["trial"].to_numpy()
        before = sum(len(one.frame) for one in logs[:source_index])
        trials.append(
            TrialError(
                logs[source_index].source,
                int(numbers[int(np.argmax(rows)) - before]),
                float(np.mean(np.abs(off[rows]))),
                _rms(off[rows]),
                _rms(off_again[rows]),
            )
        )
    position = columns_of(recording.axis.kind)["position"]
    name, _, unit = position.rpartition("_")
    number = logs[0].frame["trial"].to_numpy() if len(logs) == 1 else motion.trial
    frame = pd.DataFrame(
        {"trial": number, "time_s": motion.time, position: measured, f"{name}_simulated_{unit}": path}
    )
    return Simulation(
        frame,
        tuple(trials),
        float(np.mean(np.abs(off))),
        _rms(off),
        _rms(off_again),
        float(motion.step.sum()),
        (*recording.contradictions, *notes, *file.notes, *recording.remarks),
        is_linear(recording.axis.units),
    )


def _rms(values: Array) -> float:
    with np.errstate(over="ignore"):  # of an axis that ran away
        return float(np.sqrt(np.mean(values**2)))
