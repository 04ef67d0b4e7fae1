"""Force-free control: the axis yields to a hand, sensed by the motor current alone (paper Eq. 11).

    q_d = K_r { K_c (tau_d + tau_g - K i) - qdot } + q

The bracket (...) is the hand's torque: a motor that holds gravity and friction needs less current by
what the hand carries, so it is positive for a hand that pushes +q.

How the gains are read. K_c (rad/s per N m) is the axis' yielding: with a stiff position loop Eq. 11
says w = K_c tau_ext. K_r (s) turns a missing speed into a lead of the command over the position. A
servo whose position loop has the time constant T (lead = T w) settles where

    K_r (K_c tau_ext - w) = T w,      so      w = K_c tau_ext K_r / (K_r + T).

Sent literally, the equation closes that loop through a velocity that is one period old with the gain
K_r / T, 20 to 100 on ordinary servos: it vibrates. Here it is solved for its own velocity instead, and
the command is q + T w: the same steady state, no loop to vibrate. T starts at `servo_time_s` and is
trimmed while a hand guides.

A hand that lets go is met at once: when the estimate falls so fast that it will be gone within
`RELEASE_S`, the axis brakes, and for a moment what the braking itself does to the current is not taken
for a hand. How the estimate is made is in `sensing`; the first `settle_s` seconds it listens, hands off.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any

from idtool.control.guard import Fault, Guard, Limits, Measurement, State, Status
from idtool.control.online import OnlineModel
from idtool.control.sensing import HandSense
from idtool.parameters import Controller, Parameters

#: The paper's gains (its Table 5): K_r in s, K_c in rad/s per N m. On a linear axis the yielding that
#: the paper's hand felt: 19.20 mm/s at 5.56 N.
COMMAND_GAIN = 2.05
LOOP_GAIN = {"rotary": 1.68, "linear": 0.0192 / 5.56}
#: Control period of a file that names none, s.
DEFAULT_PERIOD_S = 0.01
#: Smallest step of a position sensor: 4096 counts a turn; 10 micrometres on a linear axis.
RESOLUTION = {"rotary": 2.0 * math.pi / 4096, "linear": 1e-5}
#: A torque that falls so fast that it is gone within this time is a hand that lets go, s.
RELEASE_S = 0.04
#: For how long after that nothing is taken for a hand, s.
_BRAKE_S = 0.05
#: Slower than this an axis is stopping, not moving, in resolutions per second.
_REST_COUNTS_PER_S = 33.0
#: A fall per period below this share of the starting torque is noise.
_FALL_NOISE = 0.5
#: Below this share of the starting torque a guided axis stops; so many samples above it start it.
_STOP_SHARE = 0.7
_START_SAMPLES = 2
#: How fast the servo's time constant is trimmed, 1/s, and by how much at most.
_TRIM_RATE = 3.0
_TRIM_RANGE = 5.0


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
        limits: Limits | None = None,
        servo_time_s: float = 0.05,
        filter_s: float = 0.015,
        settle_s: float = 0.2,
        start_torque: float | None = None,
        resolution: float | None = None,
    ) -> None:
        """Read the file.

        Args:
            parameters: axis with torque constant, gravity and static friction at least.
            period_s: control period, s; None takes the file's, or 0.01.
            limits: see `Limits`.
            servo_time_s: first guess of the position loop's time constant, s.
            filter_s: time constant of the filter on the hand's torque, s.
            settle_s: how long it reads the bristle before it follows a hand, s.
            start_torque: a hand below this does not start a motion, N m (N); None: 0.3 of the greater
                friction level.
            resolution: smallest step of the position sensor, rad (m); None: 4096 a turn, or 10 um.

        Raises:
            InputError: the file lacks the torque constant, gravity or static friction.
        """
        self.model = OnlineModel(parameters)
        self.model.drop("external_periodic", "its phase is not known once the clock starts anew")
        kind = parameters.axis.kind
        chosen = gains(parameters, period_s or DEFAULT_PERIOD_S)
        self.command_gain = chosen.command_gain
        self.loop_gain = chosen.loop_gain
        self.period = float(period_s or chosen.period)
        self.limits = limits or Limits()
        self.resolution = resolution or RESOLUTION[kind]
        self.servo_time = servo_time_s
        self.start_torque = start_torque or 0.3 * self.model.friction_bound
        self._settle = settle_s
        self._sense = HandSense(self.model, self.period, filter_s, self.resolution)
        self._guard = Guard(self.limits, self.period, self.resolution, "m" if kind == "linear" else "rad")
        self._rest_speed = _REST_COUNTS_PER_S * self.resolution
        self._history: deque[Measurement] = deque(maxlen=50)
        self.reset()

    def reset(self) -> None:
        """Start anew, as after construction: what was trimmed is forgotten too."""
        self._lead_time = self.servo_time
        self._clock = 0.0
        self._anchor = self._command = self.limits.clip(0.0)
        self._known = False
        self._begin()

    def recover(self) -> None:
        """Leave a fault: the next sample is trusted again, and the axis stays where it is then."""
        self._begin()

    def _begin(self) -> None:
        self._sense.reset()
        self._guard.reset()
        self._history.clear()
        self._state = State.STARTING
        self._fault: Fault | None = None
        self._previous: Measurement | None = None
        self._begun_at = 0.0
        self._wanted = 0.0
        self._last_push = 0.0
        self._pushed = 0
        self._brake_until = 0.0
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
    ) -> float:
        """One period: the measurement in, the position command out.

        Args:
            position_rad, velocity_rad_s, current_a: measured, rad, rad/s (m, m/s) and A.
            payload_kg: what the axis carries.
            tilt_alpha_rad, tilt_beta_rad: tilt, as in logs.
            temperature_degc: for a file with `thermal_drift` by a sensor.
            time_s: when it was measured; None counts periods. With it a repeated or late sample shows.

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
            self._begun_at = sample.time
            self._anchor = self.limits.clip(sample.position)
            if not self._known:
                self._command = self._anchor
            self._known = True
        self._command = self._bounded(self._wished(sample))
        self._previous = sample
        return self._command

    @property
    def status(self) -> Status:
        """What the last step found and did."""
        load = self.model.load
        return Status(
            state=self._state,
            message=self._message(),
            command_valid=self._known,
            position_command=self._command,
            external_torque=self._sense.torque,
            velocity_wanted=self._wanted,
            gravity=load.gravity,
            friction=load.friction + self._sense.slack,
            effects=load.effects,
            limited=self._limited,
            fault=self._fault,
            notes=tuple(self.model.skipped),
        )

    def _wished(self, sample: Measurement) -> float:
        """The command before the limits: hold the anchor, or lead the position by what yields."""
        self._wanted = 0.0
        if self._state is State.STARTING:
            self._sense.listen(sample)
            if sample.time - self._begun_at >= self._settle:
                self._sense.settle()
                self._state = State.RESTING
            return self._anchor
        torque = self._sense.feel(sample)
        push = abs(torque)
        falls = self._last_push - push
        self._last_push = push
        if self._state is State.RESTING:
            # more than once: a single sample is noise, or what braking left in the filter
            self._pushed = self._pushed + 1 if push > self.start_torque else 0
            if sample.time < self._brake_until:
                # the servo's own loops are still coming to rest: do not pull the axis back
                self._anchor = self.limits.clip(sample.position)
                return self._anchor
            if self._pushed < _START_SAMPLES:
                return self._anchor
            self._state = State.GUIDING
        elif self._state is State.GUIDING:
            # an axis that speeds up takes torque for its inertia: that fall is no hand leaving
            noise = _FALL_NOISE * self.start_torque
            leaves = 0.0 if self._speeds_up(sample) else max(falls - noise, 0.0)
            if push - leaves * RELEASE_S / self.period < _STOP_SHARE * self.start_torque:
                self._state = State.STOPPING
                self._brake_until = sample.time + _BRAKE_S
        if self._state is State.STOPPING:
            return self._brake(sample, push)
        return self._lead(sample, torque)

    def _speeds_up(self, sample: Measurement) -> bool:
        return self._previous is not None and abs(sample.velocity) > abs(self._previous.velocity)

    def _lead(self, sample: Measurement, torque: float) -> float:
        """Eq. 11, solved for its own velocity."""
        wanted = self.command_gain / (self.command_gain + self._lead_time) * self.loop_gain * torque
        if abs(wanted) > self.limits.speed:
            wanted = math.copysign(self.limits.speed, wanted)
            self._limited += ("speed",)
        self._wanted = wanted
        if abs(wanted) > 2.0 * self._rest_speed:
            missing = min(max((wanted - sample.velocity) / wanted, -1.0), 1.0)
            trimmed = self._lead_time * (1.0 + _TRIM_RATE * self.period * missing)
            low, high = self.servo_time / _TRIM_RANGE, self.servo_time * _TRIM_RANGE
            self._lead_time = min(max(trimmed, low), high)
        return sample.position + self._lead_time * wanted

    def _brake(self, sample: Measurement, push: float) -> float:
        """No lead until the axis stands; then the anchor is where it stands."""
        if abs(sample.velocity) <= self._rest_speed:
            self._state = State.RESTING
            self._pushed = 0
            self._anchor = self.limits.clip(sample.position)
        elif sample.time > self._brake_until and push > self.start_torque:
            self._state = State.GUIDING  # it was a hand that eased off, not one that left
        return sample.position

    def _bounded(self, wished: float) -> float:
        """The command inside the limits."""
        command = wished
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
        self._state = State.FAULT
        self._wanted = 0.0
        if self._previous is not None:
            self._command = self._bounded(self._previous.position)
        return self._command

    def _message(self) -> str:
        if self._fault is not None:
            held = "holds the last safe position" if self._known else "has no safe position yet, send nothing"
            return f"{self._fault.message}; {held}; call recover() to go on"
        if self._state is State.STARTING:
            return "reads the friction from the current, hands off"
        if self._state is State.RESTING:
            return "rests until a hand pushes"
        if self._state is State.STOPPING:
            return "stops, the hand let go"
        return "follows the hand" + (
            f", cut by the limit of {', '.join(self._limited)}" if self._limited else ""
        )


def _float(value: Any) -> float:
    """A number, or NaN for whatever is none, which the guard then names."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan
