"""Hand guiding on a rig: controller, hand, recording.

On a simulated rig a simulated hand pushes, moves and lets go, and the run ends with figures: force,
speed, stop time, overshoot. On a real rig the hand is yours: the controller runs until it is stopped.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Fault, Limits, Reason, State
from idtool.errors import InputError, RigFault
from idtool.experiment.black_box import with_remains
from idtool.guiding.hand import Hand, travel_per_position
from idtool.guiding.record import Record, TeachFigures, measure
from idtool.io.atomic import refuse_existing
from idtool.io.defer_signals import deferred_signals
from idtool.log import LogWriter, columns_of
from idtool.model.units import file_key
from idtool.parameters import Parameters
from idtool.parameters.axis import Axis
from idtool.rig.base import Rig, Sample, Trajectory, TrialSetup, Watch
from idtool.rig.supervisor import Supervisor

#: A hand may push this much faster (share) than the limit of the rig before it is stopped.
_SPEED_TOLERANCE = 0.5
#: Rows are handed to the log in portions of this many.
LOG_EVERY = 25
#: No tare takes longer, s.
_TARE_AT_MOST_S = 30.0
#: Faults that no sensor is to blame for.
_NO_SENSOR_S = (Reason.MISMATCH, Reason.SPEED_LIMIT, Reason.ENERGY)
_NOT_TARED = (
    "the axis was not tared: it is heavier than it need be, and where the file's friction is wrong a push "
    "may run on; let it learn with --tare, hands off"
)

_NOT_MOVED = (
    "the simulated hand moved nothing: it is too weak for friction, or too slow to be seen (--hand-force is "
    "in N, --hand-speed in mm/s)"
)


@dataclass(frozen=True)
class TeachResult:
    """A run.

    Attributes:
        record: row by row.
        figures: None without a simulated hand, or where no push was completed.
        notes: what the controller could not compensate.
        interrupted: stopped by the user.
    """

    record: Record
    figures: TeachFigures | None
    notes: tuple[str, ...] = ()
    interrupted: bool = False


def teach(
    parameters: Parameters,
    controller: ForceFreeController,
    rig: Rig,
    setup: TrialSetup,
    *,
    hand: Hand | None = None,
    duration_s: float | None = None,
    log: str | os.PathLike[str] | None = None,
    force: bool = False,
    progress: Callable[[float], None] | None = None,
    tare: bool = False,
    button: Callable[[float], bool] | None = None,
    told_payload_kg: float | None = None,
    watch: Watch | None = None,
) -> TeachResult:
    """Run the controller on a rig.

    The controller acts once per its own period, which may be several of the rig's; a simulated hand and
    the record follow the rig's.

    Args:
        parameters: the file that the controller was made from (axis and travel per radian).
        controller: it is reset first.
        rig: prepared here; stopped in every case, not closed.
        setup: payload and tilt, told to the controller too.
        hand: a simulated hand (needs a simulated rig); None: whoever is there pushes.
        duration_s: how long; None takes the hand's, and without a hand runs until interrupted.
        log: where to write the run as a log; what was appended survives a kill.
        force: overwrite it.
        progress: called with the share done, 0 to 1.
        button: whether the teach button is down, given the time of the run, s; None: no button, the axis
            always follows. Hands off for a moment before it goes down first.
        tare: let the controller learn load and friction first, hands off (mode "light"; it moves by itself,
            while the button is down).
        told_payload_kg: what the controller is told instead of the truth, kg; None: the truth.
        watch: called with every sample and the estimate of the hand.

    Raises:
        InputError: the log cannot be written, or a simulated hand was given to a real rig.
        RigFault: the rig failed, or the controller met a measurement that it cannot trust; the log
            holds the run up to there, and the last second is in a file beside it.
    """
    if hand is not None and not rig.simulated:
        raise InputError("a simulated hand cannot push a real axis", remedy="push it yourself")
    if button is not None:
        button = _released_first(button)
    truth, setup = setup, setup if told_payload_kg is None else replace(setup, payload_kg=told_payload_kg)
    length = duration_s if duration_s is not None else (hand.duration if hand else math.inf)
    held = max(1, round(controller.period / rig.period_s))
    recorder = _Recorder(parameters.axis, rig, truth, log, force)
    controller.reset()
    interrupted = False
    fault: Fault | None = None
    rig = watched = Supervisor(rig, speed_tolerance=_SPEED_TOLERANCE)
    try:
        rig.prepare(truth)
        place = place_of(rig) if setup.start_position is None else setup.start_position
        sample = rig.step(place)
        effort = sample.effort
        if tare:
            sample, effort = _tare(controller, rig, setup, sample, held, button)
            fault = controller.status.fault
        begun = sample.time_s
        while fault is None and sample.time_s - begun < length:
            down = button is None or button(sample.time_s - begun)
            command = _command(controller, setup, sample, effort, enabled=down)
            fault = controller.status.fault
            if fault is not None:
                break  # its sample is in the fault's history, not in the log
            effort = 0.0
            for _ in range(held):
                push = hand.torque(sample.time_s - begun, sample.position, sample.velocity) if hand else 0.0
                recorder.add(sample, begun, command, push, controller)
                if watch is not None:
                    hand_now = controller.status.external_torque
                    watch(sample.time_s, sample.position, sample.effort, hand_now)
                sample = rig.step(command, push)
                effort += sample.effort / held
            if progress is not None and length < math.inf:
                progress(min((sample.time_s - begun) / length, 1.0))
        if fault is not None:
            remedy = "" if fault.reason in _NO_SENSOR_S else "; check sensors and bus, then start again"
            count = len(recorder.rows)
            raise RigFault(
                f"the controller stopped following after {count} samples: {fault.message}{remedy}."
            )
    except KeyboardInterrupt:
        interrupted = True
    except BaseException as error:
        with deferred_signals():
            with suppress(RigFault):  # where stopping fails too, the first fault is the one to tell
                rig.stop()
            if isinstance(error, RigFault):
                error.history = error.history or watched.last_second()
                if log is not None and recorder.rows:
                    raise with_remains(error, log, parameters.axis) from error
        raise
    finally:
        with deferred_signals():
            recorder.close()
    with deferred_signals():
        rig.stop()
    record = recorder.record()
    figures = None
    if hand is not None and len(record.time):
        figures = measure(
            record, hand, resolution=controller.resolution, travel_ratio=travel_per_position(parameters)
        )
    notes = list(dict.fromkeys((*recorder.notes, *controller.status.notes)))
    if figures is not None and not np.any(
        np.abs(record.position - record.position[0]) > controller.resolution
    ):
        notes.append(_NOT_MOVED)
    if controller.mode == "light" and not tare:
        notes.append(_NOT_TARED)
    return TeachResult(record, figures, tuple(notes), interrupted)


def _released_first(button: Callable[[float], bool]) -> Callable[[float], bool]:
    """A button that is down when a session begins counts once it was up."""
    was_up = False

    def down(run_s: float) -> bool:
        nonlocal was_up
        pressed = button(run_s)
        was_up = was_up or not pressed
        return pressed and was_up

    return down


def _tare(
    controller: ForceFreeController,
    rig: Rig,
    setup: TrialSetup,
    sample: Sample,
    held: int,
    button: Callable[[float], bool] | None,
) -> tuple[Sample, float]:
    """Step without a hand until the controller rests, tare, and step until it rests again.

    The axis moves only while the button is down; one that goes up ends the tare, and it begins anew with the
    next press.
    """
    effort, asked, waited, begun = sample.effort, False, 0.0, sample.time_s
    while waited < _TARE_AT_MOST_S:
        down = button is None or button(sample.time_s - begun)
        waited += controller.period if down else 0.0
        asked = asked and down
        command = _command(controller, setup, sample, effort, enabled=down)
        if controller.status.fault is not None:
            break
        effort = 0.0
        for _ in range(held):
            sample = rig.step(command)
            effort += sample.effort / held
        if not asked:
            asked = controller.tare()
        elif controller.ready:
            break
    return sample, effort


def with_session(limits: Limits, *, guided_speed: float, energy: float, idle_s: float) -> Limits:
    """These limits, and those of a session.

    Args:
        limits: of the controller.
        guided_speed: rad/s (m/s): the axis yields no faster, and half as fast again stops it.
        energy, idle_s: as of `Limits`.
    """
    return replace(
        limits,
        speed=min(limits.speed, guided_speed),
        guided_speed=(1.0 + _SPEED_TOLERANCE) * guided_speed,
        energy=energy,
        idle_s=idle_s,
    )


def limits_of(rig: Rig) -> Limits:
    """The controller's limits on a rig: its range and speed; what it may report goes well beyond them."""
    low, high = rig.limits.position
    return Limits(
        position_min=low,
        position_max=high,
        speed=rig.limits.speed,
        measured_speed=4.0 * rig.limits.speed,
        current=4.0 * rig.limits.current,
    )


def place_of(rig: Rig) -> float:
    """Where the axis is: a rig reports it only while it is commanded, so command it to stand."""
    blocks = list(rig.play(Trajectory(rig.period_s, "velocity", np.zeros(3))))
    return float(blocks[-1].position[-1])


def _command(
    controller: ForceFreeController,
    setup: TrialSetup,
    sample: Sample,
    effort: float,
    *,
    enabled: bool = True,
) -> float:
    return controller.step(
        sample.position,
        sample.velocity,
        effort,
        setup.payload_kg,
        setup.tilt_alpha_rad,
        setup.tilt_beta_rad,
        temperature_degc=sample.temperature,
        time_s=sample.time_s,
        enabled=enabled,
    )


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


class _Recorder:
    """Keeps the rows and, if asked, appends them to a log as they come."""

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
