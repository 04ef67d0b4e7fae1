"""The paper's law, solved for its own velocity (see `force_free`)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from idtool.control.guard import Limits, Measurement, State
from idtool.control.law import Law
from idtool.control.online import OnlineModel
from idtool.control.sensing import HandSense

#: A torque that falls so fast that it is gone within this time is a hand that lets go, s.
RELEASE_S = 0.04
#: For how long after that nothing is taken for a hand, s.
_BRAKE_S = 0.05
#: Two times closer than this are one, s: half a step of a board's clock, on which the exported C counts.
_SAME_TIME = 0.5e-6
#: A fall per period below this share of the starting torque is noise.
_FALL_NOISE = 0.5
#: Below this share of the starting torque a guided axis stops; so many samples above it start it.
_STOP_SHARE = 0.7
_START_SAMPLES = 2
#: How fast the servo's time constant is trimmed, 1/s, and by how much at most.
_TRIM_RATE = 3.0
_TRIM_RANGE = 5.0


@dataclass(frozen=True)
class PaperSettings:
    """How the law is set; N m and rad (N and m on a linear axis).

    Attributes:
        command_gain: K_r, s.
        loop_gain: K_c, speed per torque of the hand, rad/s per N m.
        start_torque: a hand below this starts no motion.
        servo_time: first guess of the position loop's time constant, s.
        filter_time: of the filter on the hand's torque, s.
        settle: how long it listens before it follows a hand, s.
    """

    command_gain: float
    loop_gain: float
    start_torque: float
    servo_time: float
    filter_time: float
    settle: float


@final
class PaperLaw(Law):
    """Eq. 11, and the braking of a hand that lets go."""

    def __init__(
        self,
        model: OnlineModel,
        limits: Limits,
        period: float,
        resolution: float,
        settings: PaperSettings,
    ) -> None:
        """Everything as in `ForceFreeController`."""
        super().__init__(model, limits, period, resolution)
        self.settings = settings
        self._sense = HandSense(model, period, settings.filter_time, resolution)
        self.reset()

    def reset(self) -> None:
        """What was trimmed is forgotten too."""
        self._lead_time = self.settings.servo_time
        self.begin(0.0)

    def begin(self, position: float) -> None:
        """The bristle is unknown: listen first."""
        self._sense.reset()
        self.anchor = self.limits.clip(position)
        self.state = State.STARTING
        self._previous: Measurement | None = None
        self._begun_at = 0.0
        self.torque = self.wanted = self.extra = 0.0
        self._last_push = 0.0
        self._pushed = 0
        self._brake_until = 0.0
        self.limited = ()

    def stand(self, position: float) -> None:
        """The bristle is where its model has it."""
        self.anchor = self.limits.clip(position)
        self.wanted = self._last_push = 0.0
        self._sense.resume()
        self.rest()

    def rest(self) -> None:
        """The bristle stays as it is."""
        self.state = State.RESTING
        self._pushed = 0

    def raw_command(self, sample: Measurement) -> float:
        """Hold the anchor, or lead the position by what yields."""
        self.limited = ()
        self.wanted = 0.0
        if self._previous is None:
            self._begun_at = sample.time
        command = self._next_command(sample)
        self.extra, self.raw = self._sense.slack, self._sense.raw
        self._previous = sample
        return command

    def _next_command(self, sample: Measurement) -> float:
        if self.state is State.STARTING:
            self._sense.listen(sample)
            if sample.time - self._begun_at > self.settings.settle - _SAME_TIME:
                self._sense.settle()
                self.state = State.RESTING
            return self.anchor
        self.torque = torque = self._sense.feel(sample)
        push = abs(torque)
        falls = self._last_push - push
        self._last_push = push
        if self.state is State.RESTING:
            # more than once: a single sample is noise, or what braking left in the filter
            self._pushed = self._pushed + 1 if push > self.settings.start_torque else 0
            if sample.time < self._brake_until - _SAME_TIME:
                # the servo's own loops are still coming to rest: do not pull the axis back
                self.anchor = self.limits.clip(sample.position)
                return self.anchor
            if self._pushed < _START_SAMPLES:
                return self.anchor
            self.state = State.GUIDING
        elif self.state is State.GUIDING:
            # an axis that speeds up takes torque for its inertia: that fall is no hand leaving
            noise = _FALL_NOISE * self.settings.start_torque
            leaves = 0.0 if self._speeds_up(sample) else max(falls - noise, 0.0)
            if push - leaves * RELEASE_S / self.period < _STOP_SHARE * self.settings.start_torque:
                self.state = State.STOPPING
                self._brake_until = sample.time + _BRAKE_S
        if self.state is State.STOPPING:
            return self._brake(sample, push)
        return self._lead(sample, torque)

    def _speeds_up(self, sample: Measurement) -> bool:
        return self._previous is not None and abs(sample.velocity) > abs(self._previous.velocity)

    def _lead(self, sample: Measurement, torque: float) -> float:
        """Eq. 11, solved for its own velocity."""
        gain = self.settings.command_gain
        wanted = gain / (gain + self._lead_time) * self.settings.loop_gain * torque
        if abs(wanted) > self.limits.speed:
            wanted = math.copysign(self.limits.speed, wanted)
            self.limited += ("speed",)
        self.wanted = wanted
        if abs(wanted) > 2.0 * self.rest_speed:
            missing = min(max((wanted - sample.velocity) / wanted, -1.0), 1.0)
            trimmed = self._lead_time * (1.0 + _TRIM_RATE * self.period * missing)
            low, high = self.settings.servo_time / _TRIM_RANGE, self.settings.servo_time * _TRIM_RANGE
            self._lead_time = min(max(trimmed, low), high)
        return sample.position + self._lead_time * wanted

    def _brake(self, sample: Measurement, push: float) -> float:
        """No lead until the axis stands; then the anchor is where it stands."""
        if abs(sample.velocity) <= self.rest_speed:
            self.state = State.RESTING
            self._pushed = 0
            self.anchor = self.limits.clip(sample.position)
        elif sample.time > self._brake_until + _SAME_TIME and push > self.settings.start_torque:
            self.state = State.GUIDING  # it was a hand that eased off, not one that left
        return sample.position
