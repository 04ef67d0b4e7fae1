"""One Feetech servo in SI units: made ready, moved, and put back as it was found.

The series has no watchdog: in its speed mode it would turn on for ever once the computer is gone. So speeds
are played as positions: the goal runs ahead of where the axis should be by a tenth of a second, and the speed
at which the servo goes there is the one that is wanted. A servo that hears nothing more comes to that goal
and stands.
"""

from __future__ import annotations

import math
from contextlib import suppress

from idtool.rig.base import Limits, Mode
from idtool.rig.bus.servo import CENTRE, COUNT_RAD, Servo, ServoKind
from idtool.rig.faults import DeviceGone, NotAnswering, WrongServo
from idtool.rig.feetech import models
from idtool.rig.feetech.bus import BYTES_PER_PERIOD, Bus

#: By how much the goal is ahead of a motion, s, and with it how long one goes on that hears nothing more. It
#: is longer than the lag of the position loop, or the axis would brake before each goal.
AHEAD_S = 0.12
#: Speed at which the axis is taken over where it stands, and with which it comes to rest, rad/s.
_GENTLE = 0.15
#: An axis that is farther from its goal than this is blocked, and is held where it is, rad.
_FOLLOWING = 0.1
#: Highest acceleration that the register takes; 0 is none.
_MOST_ACCELERATION = 254


class FeetechServo(Servo):
    """A servo of the STS or SMS series.

    Raises:
        WrongServo: it is of the SCS series, which has another memory table.
        ServoShutdown: it reports an error.
        NotAnswering, DeviceGone: nobody is there.
    """

    _bus: Bus
    measures = "voltage"
    duty_unit, return_delay = models.DUTY_UNIT, models.RETURN_DELAY
    bytes_per_period = BYTES_PER_PERIOD

    def __init__(self, bus: Bus, zero: int = CENTRE) -> None:
        super().__init__(bus, zero)
        bus.ping()
        if bus.read(models.BYTE_ORDER):
            raise WrongServo(
                f"the device with id {bus.id} is no servo of the STS or SMS series; "
                "those of the SCS series have another table"
            )
        number = bus.read(models.MODEL)
        self.name = f"Feetech {models.MODELS.get(number, f'STS/SMS model {number}')}"
        # a servo set to silence would look dead from here on; the setting is lost with its power
        bus.write_unanswered(models.STATUS_LEVEL, 1)
        bus.raise_shutdown()
        self._unit = 1 if bus.read(models.PHASE) & models.FINE_SPEED_BIT else models.COARSE
        self.speed_step = self._unit * models.SPEED_UNIT
        low, high = bus.read(models.MIN_POSITION_LIMIT), bus.read(models.MAX_POSITION_LIMIT)
        if low >= high:
            raise WrongServo("the servo is set to turn without limits; set its lowest and highest position")
        self._range = low, high
        self.torque_off()
        self._acceleration = _MOST_ACCELERATION
        #: where the axis should be, how fast by its ramps, how fast it is to be, and since when
        self._place = self._pace = self._speed = self._since = 0.0

    # ----------------------------------------------------------------- what it is set to

    def own_limits(self) -> Limits:
        """As of every servo; the speed is what the register takes at most, which the motor may not reach."""
        low, high = self._range
        return Limits(
            position=(self._radians(low), self._radians(high)),
            speed=models.HIGHEST_SPEED * models.SPEED_UNIT,
            duty=self._bus.read(models.TORQUE_LIMIT) * models.DUTY_UNIT,
            temperature=float(self._bus.read(models.TEMPERATURE_LIMIT)),
        )

    def limit(self, speed: float, current: float, duty: float) -> None:
        """Let the servo itself keep to a duty; speeds are limited with every goal."""
        self._found.change(models.TORQUE_LIMIT, round(duty / models.DUTY_UNIT))

    # ------------------------------------------------------------------------- motion

    def enter(self, mode: Mode, *, speed: float, current: float) -> None:
        """As every servo; speeds, too, are goals of positions, and a current limits nothing."""
        self._fastest = max(1, math.floor(speed / self.speed_step))
        if self.mode is None:
            self._found.change(models.OPERATING_MODE, models.POSITION_MODE)
            for register in (models.ACCELERATION, models.GOAL_SPEED):  # set with every goal, so put back here
                self._found.setdefault(register, self._bus.read(register))
            self._place = self._radians(self._bus.present().position)
            # before the torque, so that it cannot jump, and again, since some take the place where they stand
            self._go(self._place, _GENTLE)
            self._bus.write(models.TORQUE_ENABLE, 1)
            self._go(self._place, _GENTLE)
            self._bus.torque = True
        self._pace, self._speed, self._since = 0.0, 0.0, self._bus.clock.now()
        self.mode = mode

    def torque_off(self) -> None:
        self._bus.torque = False
        self._bus.write(models.TORQUE_ENABLE, 0, alert=False)
        self.mode = None

    def accelerate_at(self, acceleration: float) -> None:
        units = math.ceil(acceleration / models.ACCELERATION_UNIT)
        self._acceleration = min(max(units, 1), _MOST_ACCELERATION)

    def move_at(self, speed: float) -> float:
        self._go_on()
        units = round(speed / self.speed_step)
        before, self._speed = self._speed, units * self.speed_step
        if units == 0:
            steepest = self._acceleration * models.ACCELERATION_UNIT
            self._place += self._pace * abs(self._pace) / (2.0 * steepest)
            self._pace = 0.0
        # to rest it goes on as fast as it was; a speed of 0 is the highest to some servos
        self._go(self._place + self._speed * AHEAD_S, abs(self._speed) or abs(before) or _GENTLE)
        return self._speed

    def _go_on(self) -> None:
        """Where the axis should be by now: on its way, but never beyond the goal that it was given."""
        now = self._bus.clock.now()
        passed = min(now - self._since, AHEAD_S * max(self._bus.clock.scale, 1.0))
        steepest = self._acceleration * models.ACCELERATION_UNIT * passed
        pace = self._pace + min(max(self._speed - self._pace, -steepest), steepest)
        self._place += 0.5 * (self._pace + pace) * passed
        self._pace, self._since = pace, now

    def move_to(self, position: float) -> float:
        counts = self._counts(position)
        self._bus.set_goal(counts, self._fastest, 0)
        self._place = self._radians(counts)
        return self._place

    def hold(self) -> None:
        """As every servo.

        It stays on its goal: a position loop without integral action would sink further if its goal were the
        place to which its load has made it sink. One that is far from its goal is blocked and stays there.
        """
        if self.mode is None:
            return
        self._go_on()
        here = self._radians(self._bus.present(alert=False).position)
        if abs(self._place - here) > _FOLLOWING:
            self._place = here
        self._acceleration = _MOST_ACCELERATION
        self._go(self._place, abs(self._speed) or _GENTLE, alert=False)
        self._pace = self._speed = 0.0

    def _go(self, position: float, speed: float, *, alert: bool = True) -> None:
        units = min(max(round(speed / self.speed_step), 1), models.HIGHEST_SPEED // self._unit)
        self._bus.set_goal(self._counts(position), units, self._acceleration, alert=alert)

    def arm(self) -> None:
        """Nothing to do: every goal is one at which the axis may stand."""

    def disarm(self) -> None:
        """Nothing to do."""

    # ---------------------------------------------------------------------- way out

    def release(self) -> None:
        self.torque_off()
        with suppress(NotAnswering, DeviceGone):
            self._found.restore()

    def _counts(self, position: float) -> int:
        low, high = self._range
        return min(max(self._zero + round(position / COUNT_RAD), low), high)


FEETECH = ServoKind(baud=1_000_000, open_bus=Bus, servo=FeetechServo)
