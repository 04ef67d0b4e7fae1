"""Hand guiding on a rig: controller, hand, recording.

On a simulated rig a simulated hand pushes, moves and lets go, and the run ends with figures: force,
speed, stop time, overshoot. On a real rig the hand is yours: the controller runs until it is stopped.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from idtool.control.force_free import ForceFreeController
from idtool.control.guard import Fault, Limits, Reason
from idtool.errors import InputError, RigFault
from idtool.guiding.hand import Hand, travel_per_position
from idtool.guiding.record import Record, TeachFigures, measure
from idtool.guiding.recorder import Recorder
from idtool.parameters import Parameters
from idtool.rig.base import Rig, Sample, Trajectory, TrialSetup, Watch
from idtool.rig.supervisor import SupervisedRun, Supervisor

#: A hand may push this much faster (share) than the limit of the rig before it is stopped.
_SPEED_TOLERANCE = 0.5
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
    told = setup if told_payload_kg is None else replace(setup, payload_kg=told_payload_kg)
    length = duration_s if duration_s is not None else (hand.duration if hand else math.inf)
    recorder = Recorder(parameters.axis, rig, setup, log, force)
    controller.reset()
    supervised = Supervisor(rig, speed_tolerance=_SPEED_TOLERANCE)
    down = _released_first(button) if button else None
    with _Run(controller, supervised, told, hand, down, recorder) as run:
        supervised.prepare(setup)
        run.begin(place_of(supervised) if setup.start_position is None else setup.start_position)
        if tare:
            run.tare()
        run.guide(length, watch, progress)
        if (fault := run.fault) is not None:
            remedy = "" if fault.reason in _NO_SENSOR_S else "; check sensors and bus, then start again"
            count = len(recorder.rows)
            raise RigFault(
                f"the controller stopped following after {count} samples: {fault.message}{remedy}."
            )
    record = recorder.record()
    figures = None
    if hand is not None and len(record.time):
        figures = measure(
            record, hand, resolution=controller.resolution, travel_ratio=travel_per_position(parameters)
        )
    notes = list(dict.fromkeys((*recorder.notes, *controller.status.notes)))
    moved = np.abs(record.position - record.position[0]) > controller.resolution
    if figures is not None and not moved.any():
        notes.append(_NOT_MOVED)
    if controller.mode == "light" and not tare:
        notes.append(_NOT_TARED)
    return TeachResult(record, figures, tuple(notes), run.interrupted)


def _released_first(button: Callable[[float], bool]) -> Callable[[float], bool]:
    """A button that is down when a session begins counts once it was up."""
    was_up = False

    def down(run_s: float) -> bool:
        nonlocal was_up
        pressed = button(run_s)
        was_up = was_up or not pressed
        return pressed and was_up

    return down


class _Run(SupervisedRun):
    """Steps of a controller on a rig: it acts once per its own period, on the mean effort since it last did.

    Args:
        controller, rig, hand: as in `teach`.
        setup: payload and tilt as the controller is told them.
        button: whether the teach button is down, given the time of the run, s; None: there is none.
        recorder: of what is guided.
    """

    def __init__(
        self,
        controller: ForceFreeController,
        rig: Supervisor,
        setup: TrialSetup,
        hand: Hand | None,
        button: Callable[[float], bool] | None,
        recorder: Recorder,
    ) -> None:
        super().__init__(rig)
        self._controller, self._setup, self._hand = controller, setup, hand
        self._button, self._recorder = button, recorder
        self._held = max(1, round(controller.period / rig.period_s))

    @property
    def fault(self) -> Fault | None:
        """Why the controller stopped following."""
        return self._controller.status.fault

    def begin(self, place: float) -> None:
        """Stand at a place for one period of the rig."""
        self._sample = self._rig.step(place)
        self._effort = self._sample.effort

    def tare(self) -> None:
        """Step without a hand until the controller rests, tare, and step until it rests again.

        The axis moves only while the button is down; one that goes up ends the tare, and it begins anew with
        the next press.
        """
        asked, waited, begun = False, 0.0, self._sample.time_s
        while waited < _TARE_AT_MOST_S:
            down = self._down(begun)
            waited += self._controller.period if down else 0.0
            asked = asked and down
            command = self._command(enabled=down)
            if self.fault is not None:
                return
            self._hold(command, lambda _: 0.0)
            if not asked:
                asked = self._controller.tare()
            elif self._controller.ready:
                return

    def _told(self, fault: RigFault) -> RigFault:
        fault.history = fault.history or self._rig.last_second()
        return self._recorder.with_remains(fault)

    def _end(self) -> None:
        self._recorder.close()

    def guide(self, length: float, watch: Watch | None, progress: Callable[[float], None] | None) -> None:
        """Follow the hand for so long, s, or until a fault."""
        begun = self._sample.time_s
        while self.fault is None and self._sample.time_s - begun < length:
            command = self._command(enabled=self._down(begun))
            if self._controller.status.fault is not None:
                return  # its sample is in the fault's history, not in the log

            def followed(sample: Sample, command: float = command) -> float:
                push = 0.0
                if self._hand is not None:
                    push = self._hand.torque(sample.time_s - begun, sample.position, sample.velocity)
                self._recorder.add(sample, begun, command, push, self._controller)
                if watch is not None:
                    felt = self._controller.status.external_torque
                    watch(sample.time_s, sample.position, sample.effort, felt)
                return push

            self._hold(command, followed)
            if progress is not None and length < math.inf:
                progress(min((self._sample.time_s - begun) / length, 1.0))

    def _down(self, begun: float) -> bool:
        return self._button is None or self._button(self._sample.time_s - begun)

    def _hold(self, command: float, push: Callable[[Sample], float]) -> None:
        """Hold a command for a period of the controller, with the torque of a hand."""
        efforts = []
        for _ in range(self._held):
            self._sample = self._rig.step(command, push(self._sample))
            efforts.append(self._sample.effort)
        self._effort = math.fsum(efforts) / self._held

    def _command(self, *, enabled: bool) -> float:
        sample, setup = self._sample, self._setup
        return self._controller.step(
            sample.position,
            sample.velocity,
            self._effort,
            setup.payload_kg,
            setup.tilt_alpha_rad,
            setup.tilt_beta_rad,
            temperature_degc=sample.temperature,
            time_s=sample.time_s,
            enabled=enabled,
        )


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
