"""The rows of a run of hand guiding, as they come."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import State
from idtool.errors import InputError, RigFault
from idtool.experiment.black_box import with_remains
from idtool.guiding.record import Record
from idtool.io.atomic import refuse_existing
from idtool.log import LogWriter, columns_of
from idtool.model.units import file_key
from idtool.parameters.axis import Axis
from idtool.rig.base import Rig, Sample, TrialSetup

#: Rows are handed to the log in portions of this many.
_LOG_EVERY = 25


class RunLog:
    """The log of an axis that is sent from place to place; what it was handed survives a kill.

    Args:
        path, axis, experiment, force: as of `LogWriter`.
        rig: that is run.
        setup: payload and tilt as they are.
        torques: names of torques that stand in it beside the command.
        temperature: whether it holds one.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        axis: Axis,
        experiment: str,
        rig: Rig,
        setup: TrialSetup,
        *,
        force: bool,
        torques: tuple[str, ...] = (),
        temperature: bool = False,
    ) -> None:
        roles = columns_of(axis.kind)
        names = ("trial", "time", "position", "velocity", *rig.step_readings, "position_command")
        around = (*setup.logged, *(("temperature",) if temperature else ()))
        columns = [roles[name] for name in names]
        columns += [file_key(name, "torque", axis.kind) for name in torques]
        columns += [roles[name] for name in around]
        self._readings = tuple(rig.step_readings.values())
        self._setup = tuple(setup.logged.values())
        self._temperature = temperature
        self._rows: list[tuple[float | None, ...]] = []
        self._writer = LogWriter(path, columns, axis, experiment, force=force)

    def add(self, time_s: float, sample: Sample, command: float, *torques: float) -> None:
        """A sample at this time of the run, and what was commanded after it."""
        efforts = (getattr(sample, name) for name in self._readings)
        warm = (sample.temperature,) if self._temperature else ()
        motion = (0.0, time_s, sample.position, sample.velocity, *efforts, command)
        self._rows.append((*motion, *torques, *self._setup, *warm))
        if len(self._rows) >= _LOG_EVERY:
            self._flush()

    def _flush(self) -> None:
        rows, self._rows = np.array(self._rows, dtype=float), []
        if len(rows):
            self._writer.append(rows)

    def close(self) -> None:
        """Hand on what is left."""
        try:
            self._flush()
        finally:
            self._writer.close()


class Recorder:
    """Keeps the rows of a run and, if asked, appends them to a log as they come.

    Args:
        axis: of the log.
        rig: that is run.
        setup: payload and tilt as they are.
        log: where to write; None keeps the rows alone.
        force: overwrite it.

    Raises:
        InputError: the log is there already.
    """

    def __init__(
        self, axis: Axis, rig: Rig, setup: TrialSetup, log: str | os.PathLike[str] | None, force: bool
    ) -> None:
        self.rows: list[tuple[float, ...]] = []
        self.states: list[State] = []
        self.notes: dict[str, None] = {}  # a set that keeps its order
        self._axis, self._rig, self._setup, self._path, self._force = axis, rig, setup, log, force
        self._log: RunLog | None = None
        if log is not None:
            refuse_existing(Path(log), force)  # before the axis moves

    def add(
        self, sample: Sample, begun: float, command: float, push: float, controller: ForceFreeController
    ) -> None:
        warm, status = sample.temperature, controller.status
        if self._path is not None and self._log is None:
            self._log = RunLog(
                self._path,
                self._axis,
                "teach",
                self._rig,
                self._setup,
                force=self._force,
                torques=("hand", "hand_estimated"),
                temperature=warm is not None,  # a rig without a thermometer gets no such column
            )
        self.rows.append(
            (
                sample.time_s - begun,
                sample.position,
                sample.velocity,
                sample.effort,
                math.nan if warm is None else warm,
                command,
                push,
                status.external_torque,
                controller.model.torque_constant * sample.effort,
                status.gravity + status.friction + status.effects,
            )
        )
        self.states.append(status.state)
        self.notes.update(dict.fromkeys(status.notes))
        if self._log is not None:
            self._log.add(sample.time_s - begun, sample, command, push, status.external_torque)

    def close(self) -> None:
        if self._log is not None:
            self._log.close()

    def with_remains(self, fault: RigFault) -> RigFault:
        """The fault, saying where its last second is if there is a log."""
        if self._path is None or not self.rows:
            return fault
        return with_remains(fault, self._path, self._axis)

    def record(self) -> Record:
        if not self.rows:
            raise InputError("the run was stopped before its first period", remedy="let it run longer")
        states = tuple(str(state) for state in self.states)
        time, position, velocity, current, warm, command, push, felt, motor, model = np.array(
            self.rows, dtype=float
        ).T
        return Record(time, position, velocity, current, warm, command, push, felt, motor, model, states)
