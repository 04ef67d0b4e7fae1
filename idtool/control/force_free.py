"""Force-free control: the axis yields to a hand, sensed by the motor current alone (paper Eq. 11).

    q_d = K_r { K_c (tau_d + tau_g - K i) - qdot } + q

The bracket (...) is the hand's torque: a motor that holds gravity and friction needs less current by
what the hand carries, so it is positive for a hand that pushes +q.

How the gains are read. K_c (rad/s per N m) is the admittance gain: with a stiff position loop Eq. 11
says w = K_c tau_ext. K_r (s) turns a missing speed into a lead of the command over the position. A
servo whose position loop has the time constant T (lead = T w) settles where

    K_r (K_c tau_ext - w) = T w,      so      w = K_c tau_ext K_r / (K_r + T).

Sent literally, the equation closes that loop through a velocity that is one period old with the gain
K_r / T, 20 to 100 on ordinary servos: it vibrates. Here it is solved for its own velocity instead, and
the command is q + T w: the same steady state, no loop to vibrate. T starts at `servo_time_s` and is
trimmed while a hand guides.

That is mode "paper". Mode "light" needs a third of the force; its law is in `admittance`, its gains come from
`ffc-id tune`.

A hand that lets go is met at once: when the estimate falls so fast that it will be gone within
`RELEASE_S`, the axis brakes, and for a moment what the braking itself does to the current is not taken
for a hand. How the estimate is made is in `sensing`; the first `settle_s` seconds it listens, hands off.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from idtool.control.admittance import AdmittanceLaw, AdmittanceSettings
from idtool.control.admittance.constants import CONSTANTS
from idtool.control.button import Hold
from idtool.control.enabling import EnabledLaw
from idtool.control.guard import Fault, Guard, Limits, Measurement, State, Status, check_torque
from idtool.control.law import WORDS, Law
from idtool.control.online import OnlineModel
from idtool.control.paper import PaperLaw, PaperSettings
from idtool.control.rest_load import RestLoad
from idtool.control.session_limits import SessionLimits
from idtool.control.uncertainty import at_rest, of_friction, per_kilogram
from idtool.errors import InputError, nearest
from idtool.parameters import CONTROLLER_MODES, Controller, Parameters
from idtool.parameters.correction import Correction

#: The paper's gains (its Table 5): K_r in s, K_c in rad/s per N m. On a linear axis the yielding that
#: the paper's hand felt: 19.20 mm/s at 5.56 N.
COMMAND_GAIN = 2.05
LOOP_GAIN = {"rotary": 1.68, "linear": 0.0192 / 5.56}
#: Control period of a file that names none, s.
DEFAULT_PERIOD_S = 0.01
#: Smallest step of a position sensor: 4096 counts a turn; 10 micrometres on a linear axis.
RESOLUTION = {"rotary": 2.0 * math.pi / 4096, "linear": 1e-5}
#: One step of a DYNAMIXEL's current reading, A, and three steps of a Feetech's duty at 12 V, V: what a sample
#: is taken to be uncertain by.
READING_NOISE = {"current": 0.003, "voltage": 0.036}
#: Of the tolerance of the payload that is told, a standard deviation; a tare that finds more than the
#: tolerance is not used.
PAYLOAD_SIGMA = 0.75
#: How far a tare moves, rad (m), and how fast at most, rad/s (m/s).
TARE_TRAVEL = {"rotary": 0.2, "linear": 0.01}
TARE_SPEED = {"rotary": 0.4, "linear": 0.02}


def gains(parameters: Parameters, period: float) -> Controller:
    """The `[controller]` of the file, or the paper's gains at `period` s where the file has none."""
    if parameters.controller is not None:
        return parameters.controller
    return Controller(COMMAND_GAIN, LOOP_GAIN[parameters.axis.kind], period)


class ForceFreeController:
    """Position commands that let a hand move the axis.

        controller = ForceFreeController(Parameters.read("params.toml"), period_s=0.01)
        q_d = controller.step(position_rad, velocity_rad_s, current_a, payload_kg=0.4)

    Call `step` once per period, the first `settle_s` seconds without a hand. On a linear axis read m
    for rad and N for N m. Nothing raises inside the loop: a stale, impossible or non-finite measurement
    makes the controller hold the last safe position and say so in `status`, until `recover` or `reset`.
    """

    def __init__(
        self,
        parameters: Parameters,
        period_s: float | None = None,
        *,
        mode: str | None = None,
        limits: Limits | None = None,
        servo_time_s: float = 0.05,
        filter_s: float = 0.015,
        settle_s: float = 0.2,
        start_torque: float | None = None,
        resolution: float | None = None,
        friction_uncertainty: float = 0.22,
        payload_uncertainty_kg: float = 0.04,
        correction: Correction | None = None,
    ) -> None:
        """Read the file.

        Args:
            parameters: axis with torque constant, gravity and static friction at least.
            period_s: control period, s; None takes the file's, or 0.01.
            mode: "paper", the published law, or "light" (`idtool.control.admittance`); None takes the file's.
            limits: see `Limits`.
            servo_time_s: first guess of the position loop's time constant, s.
            filter_s: time constant of the filter on the hand's torque, s.
            settle_s: how long it reads the bristle before it follows a hand, s.
            start_torque: a hand below this does not start a motion, N m (N); None takes the file's, or
                0.3 of the greater friction level ("paper"), 1.4 times the noise of the current beyond what a
                rest may be wrong by ("light").
            resolution: smallest step of the position sensor, rad (m); None: 4096 a turn, or 10 um.
            friction_uncertainty: mode "light": by how much friction may differ from the file, relatively, as
                a standard deviation, on top of the file's own standard errors.
            payload_uncertainty_kg: mode "light": by how much the payload may differ from the one told, kg; a
                tare that finds more is not used.
            correction: smooth correction to compensate as well; off unless given.

        Raises:
            InputError: no parameters, or without torque constant, gravity or static friction; unknown mode;
                a period that is no time.
        """
        if not isinstance(parameters, Parameters):
            raise InputError(
                f"is {type(parameters).__name__}, not Parameters",
                argument="parameters",
                remedy="give Parameters.read(...) of the file",
            )
        if period_s is not None and not 0.0 < period_s < math.inf:
            raise InputError(f"is {period_s} s", argument="period_s", remedy="give the period in seconds")
        self.model = OnlineModel(parameters, correction)
        self.model.drop("external_periodic", "its phase is not known once the clock restarts")
        kind = parameters.axis.kind
        chosen = gains(parameters, period_s or DEFAULT_PERIOD_S)
        self.command_gain = chosen.command_gain
        self.loop_gain = chosen.loop_gain
        self.period = float(period_s or chosen.period)
        self.limits = limits or Limits()
        self.resolution = resolution or RESOLUTION[kind]
        self.mode = mode or chosen.mode
        if self.mode not in CONTROLLER_MODES:
            raise InputError(f"unknown mode {self.mode!r}", remedy=nearest(self.mode, CONTROLLER_MODES))
        noise = READING_NOISE[parameters.axis.reading] * self.model.torque_constant
        least = 0.3 * self.model.friction_bound if self.mode == "paper" else CONSTANTS["start"].value * noise
        self.start_torque = start_torque or chosen.start_torque or least
        uncertainty = at_rest(
            parameters, self.model.friction_bound, friction_uncertainty, payload_uncertainty_kg, noise
        )
        common = (self.model, self.limits, self.period, self.resolution)
        self.law: Law
        if self.mode == "light":
            settings = AdmittanceSettings(
                gain=self.loop_gain,
                start_torque=self.start_torque,
                **of_friction(parameters, friction_uncertainty),
                load=PAYLOAD_SIGMA * uncertainty.payload,
                refuse=uncertainty.payload or math.inf,
                noise=noise,
                servo_time=servo_time_s,
                settle=settle_s,
                tare_travel=TARE_TRAVEL[kind],
                tare_speed=TARE_SPEED[kind],
                per_kilogram=per_kilogram(parameters).value,
            )
            self.law = AdmittanceLaw(*common, settings)
        else:
            self.law = PaperLaw(
                *common,
                PaperSettings(
                    command_gain=self.command_gain,
                    loop_gain=self.loop_gain,
                    start_torque=self.start_torque,
                    servo_time=servo_time_s,
                    filter_time=filter_s,
                    settle=settle_s,
                ),
            )
        self.rest_uncertainty, self.servo_time = uncertainty, servo_time_s
        self.rest_window = max(1, round(settle_s / self.period))
        self._around = EnabledLaw(
            self.law,
            self.model,
            RestLoad(self.rest_window, self.model.grip, uncertainty, self.limits.mismatch),
            Hold(self.limits, self.period, servo_time_s, self.law.rest_speed),
        )
        self._session = SessionLimits(self.limits, self.period, "m" if kind == "linear" else "rad")
        self._guard = Guard(self.limits, self.period, self.resolution, "m" if kind == "linear" else "rad")
        self._history: deque[Measurement] = deque(maxlen=50)
        self.reset()

    def reset(self) -> None:
        """Start anew, as after construction: what was learned and trimmed is forgotten too."""
        self.law.reset()
        self._clock = 0.0
        self._command = self.limits.clip(0.0)
        self._known = False
        self.recover()

    def recover(self) -> None:
        """Leave a fault: the next sample is trusted again, and the axis stays where it is then."""
        self._guard.reset()
        self._session.reset()
        self._history.clear()
        self._fault: Fault | None = None
        self._previous: Measurement | None = None
        self._limited: tuple[str, ...] = ()

    def step(
        self,
        position_rad: float,
        velocity_rad_s: float,
        current_a: float,
        payload_kg: float = 0.0,
        tilt_alpha_rad: float = 0.0,
        tilt_beta_rad: float = 0.0,
        temperature_degc: float | None = None,
        time_s: float | None = None,
        *,
        enabled: bool = True,
    ) -> float:
        """One period: the measurement in, the position command out.

        Args:
            position_rad, velocity_rad_s, current_a: measured, rad, rad/s (m, m/s) and A; V at the motor in
                place of A where the file's constant is of a voltage.
            payload_kg: what the axis carries.
            tilt_alpha_rad, tilt_beta_rad: tilt, as in logs.
            temperature_degc: for a file with `thermal_drift` by a sensor.
            time_s: when it was measured; None counts periods. With it a repeated or late sample shows.
            enabled: whether the teach button is down. False brakes and holds the axis, takes in a load that
                is hung on or taken off meanwhile, and takes the zero anew on the way back.

        Returns:
            Position command, rad (m). Finite and inside the limits, always.
        """
        self._limited = ()
        if self._fault is not None:
            return self._command
        self._clock += self.period
        sample = Measurement(
            _float(self._clock if time_s is None else time_s),
            _float(position_rad),
            _float(velocity_rad_s),
            _float(current_a),
            _float(payload_kg),
            _float(tilt_alpha_rad),
            _float(tilt_beta_rad),
            None if temperature_degc is None else _float(temperature_degc),
        )
        self._history.append(sample)
        wrong = self._guard.check(sample, clocked=time_s is not None)
        if wrong is not None:
            return self._fail(Fault(*wrong, tuple(self._history)))
        if self._previous is None:
            if sample.temperature is None and self.model.needs_temperature:
                self.model.drop("thermal_drift", "no temperature was given")
            self._around.begin(sample.position)
            if not self._known:
                self._command = self.law.anchor
            self._known = True
        around, law = self._around, self.law
        raw = around.raw_command(sample, enabled=self._session.enabled(bool(enabled)))
        self._previous = sample
        if around.fault is not None:
            return self._fail(Fault(*around.fault, tuple(self._history)))
        wrong = check_torque(self.limits, law.raw, "N" if self.model.axis.kind == "linear" else "N m")
        wrong = wrong or self._session.check(sample, law.torque, around.state)
        if wrong is not None:
            return self._fail(Fault(*wrong, tuple(self._history)))
        self._command = self._bounded(raw)
        return self._command

    @property
    def ready(self) -> bool:
        """Whether the axis rests and a hand may push."""
        return self._fault is None and self._previous is not None and self._around.ready

    @property
    def learned(self) -> tuple[float, float, float] | None:
        """Mode "light": load that nobody told of (N m or N), friction level and damping over the file's."""
        if not isinstance(self.law, AdmittanceLaw):
            return None
        load, level, damping = self.law.learned
        return load + self._around.load_offset, level, damping

    def tare(self) -> bool:
        """Learn the load and the friction of the moment: the axis moves to and fro by itself, hands off.

        In mode "light", while the axis rests and the button is down; a button that goes up stops it, and
        what it learned so far is dropped. It takes about three seconds of steps, in which
        `status.state` is TARING; what came of it stands in `status.notes` if it was disturbed.

        Returns:
            Whether it begins.
        """
        return self.ready and self._around.enabled and self.law.tare()

    @property
    def status(self) -> Status:
        """What the last step found and did."""
        load, law = self.model.load, self.law
        faulty = self._fault is not None
        starting = self._previous is None
        idle = "nobody guided the axis for a while: let go of the button and press it again"
        idle = idle if self._session.expired else ""
        return Status(
            state=State.FAULT if faulty else State.STARTING if starting else self._around.state,
            message=self._message(),
            command_valid=self._known,
            position_command=self._command,
            external_torque=law.torque,
            uncertainty=law.uncertainty,
            velocity_wanted=0.0 if faulty or self._around.state is State.HELD else law.wanted,
            gravity=load.gravity,
            friction=load.friction + law.extra,
            effects=load.effects,
            limited=self._limited + (() if faulty else law.limited),
            fault=self._fault,
            notes=(*self.model.skipped, *(note for note in (law.note, self._around.note, idle) if note)),
        )

    def _bounded(self, raw: float) -> float:
        """The command inside the limits."""
        command = raw
        most = self.limits.command_step
        if most is not None and abs(command - self._command) > most:
            command = self._command + math.copysign(most, command - self._command)
            self._limited += ("step",)
        inside = self.limits.clip(command)
        if inside != command:
            self._limited += ("range",)
        return inside

    def _fail(self, fault: Fault) -> float:
        """Latch a fault: hold the last position that was measured well."""
        self._fault = fault
        if self._previous is not None:
            self._command = self._bounded(self._previous.position)
        return self._command

    def _message(self) -> str:
        if self._fault is not None:
            held = "holds the last safe position" if self._known else "has no safe position yet, send nothing"
            return f"{self._fault.message}; {held}; call recover() to go on"
        cut = self._limited + self.law.limited
        return WORDS[self._around.state] + (f", cut by the limit of {', '.join(cut)}" if cut else "")


def _float(value: Any) -> float:
    """A number, or NaN for whatever is none, which the guard then names."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan
