"""The rows of a run of hand guiding, as they come."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import State
from idtool.errors import InputError
from idtool.guiding.record import Record
from idtool.io.atomic import refuse_existing
from idtool.log import LogWriter, columns_of
from idtool.model.units import file_key
from idtool.parameters.axis import Axis
from idtool.rig.base import Rig, Sample, TrialSetup

#: Rows are handed to the log in portions of this many.
LOG_EVERY = 25


def log_columns(axis: Axis, *, temperature: bool, effort: Iterable[str] = ("current",)) -> list[str]:
    """Columns of the log of a run: those of any log, and the hand's torque, true and estimated.

    Args:
        axis: of the rig.
        temperature: whether it measures one.
        effort: roles of what stands for the motor's torque.
    """
    roles = columns_of(axis.kind)
    names = ["trial", "time", "position", "velocity", *effort, "position_command"]
    columns = [roles[name] for name in names]
    columns += [file_key(name, "torque", axis.kind) for name in ("hand", "hand_estimated")]
    columns += [roles[name] for name in ("payload", "tilt_alpha", "tilt_beta")]
    return columns + ([roles["temperature"]] if temperature else [])


class Recorder:
    """Keeps the rows of a run and, if asked, appends them to a log as they come; what was appended survives
    a kill.

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
        self._readings = rig.step_readings
        self._efforts: list[tuple[float, ...]] = []
        self.states: list[State] = []
        self.notes: dict[str, None] = {}  # a set that keeps its order
        self._setup = (setup.payload_kg, setup.tilt_alpha_rad, setup.tilt_beta_rad)
        self._written = 0
        self._axis, self._log, self._force = axis, log, force
        self._warm = False
        self._writer: LogWriter | None = None
        if log is not None:
            refuse_existing(Path(log), force)  # before the axis moves

    def add(
        self, sample: Sample, begun: float, command: float, push: float, controller: ForceFreeController
    ) -> None:
        if self._log is not None and self._writer is None:
            self._warm = sample.temperature is not None  # a rig without a thermometer gets no such column
            columns = log_columns(self._axis, temperature=self._warm, effort=self._readings)
            self._writer = LogWriter(self._log, columns, self._axis, "teach", force=self._force)
        status = controller.status
        self.rows.append(
            (
                sample.time_s - begun,
                sample.position,
                sample.velocity,
                sample.effort,
                math.nan if sample.temperature is None else sample.temperature,
                command,
                push,
                status.external_torque,
                controller.model.torque_constant * sample.effort,
                status.gravity + status.friction + status.effects,
            )
        )
        self._efforts.append(tuple(getattr(sample, name) for name in self._readings.values()))
        self.states.append(status.state)
        self.notes.update(dict.fromkeys(status.notes))
        if self._writer is not None and len(self.rows) - self._written >= LOG_EVERY:
            self._flush(self._writer)

    def _flush(self, writer: LogWriter) -> None:
        rows = np.array(self.rows[self._written :], dtype=float)
        efforts = np.array(self._efforts[self._written :], dtype=float)
        self._written = len(self.rows)
        if not len(rows):
            return
        count = len(rows)
        surroundings = np.tile(self._setup, (count, 1))
        table = [np.zeros(count), *rows[:, :3].T, *efforts.T, *rows[:, 5:8].T, *surroundings.T]
        if self._warm:
            table.append(rows[:, 4])
        writer.append(np.column_stack(table))

    def close(self) -> None:
        if self._writer is not None:
            try:
                self._flush(self._writer)
            finally:
                self._writer.close()

    def record(self) -> Record:
        if not self.rows:
            raise InputError("the run was stopped before its first period", remedy="let it run longer")
        time, position, velocity, current, warm, command, push, felt, motor, model = np.array(
            self.rows, dtype=float
        ).T
        states = tuple(str(state) for state in self.states)
        return Record(time, position, velocity, current, warm, command, push, felt, motor, model, states)
