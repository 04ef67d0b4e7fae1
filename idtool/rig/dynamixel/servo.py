"""One DYNAMIXEL in SI units: made ready, moved, and put back as it was found.

Speeds are played in the velocity mode, positions in the current-based position mode, or in the position mode
of a servo that has no current mode. While the axis may move, the servo's own bus watchdog is armed.
"""

from __future__ import annotations

import math
from contextlib import suppress

from idtool.rig.base import Mode, Sample
from idtool.rig.bus.servo import CENTRE, COUNT_RAD, Servo, ServoKind
from idtool.rig.dynamixel.bus import BYTES_PER_PERIOD, Bus
from idtool.rig.dynamixel.models import (
    ACCELERATION_UNIT,
    BUS_WATCHDOG,
    CURRENT_BASED_POSITION_MODE,
    CURRENT_LIMIT,
    DRIVE_MODE,
    DUTY_UNIT,
    FOLLOWER,
    GOAL_CURRENT,
    GOAL_POSITION,
    GOAL_VELOCITY,
    MAX_POSITION_LIMIT,
    MIN_POSITION_LIMIT,
    MODELS,
    OPERATING_MODE,
    POSITION_MODE,
    PROFILE_ACCELERATION,
    PROFILE_VELOCITY,
    PWM_LIMIT,
    RETURN_DELAY,
    RETURN_DELAY_UNIT,
    SPEED_UNIT,
    STATUS_RETURN_LEVEL,
    TEMPERATURE_LIMIT,
    TIME_PROFILE,
    TORQUE_ENABLE,
    TORQUE_ON_BY_GOAL,
    VELOCITY_LIMIT,
    VELOCITY_MODE,
    VOLTAGE_UNIT,
    WATCHDOG_UNIT,
    Model,
)
from idtool.rig.faults import DeviceGone, NotAnswering, WatchdogTripped, WrongServo

#: The servo stops by itself when it hears nothing for so long, s. All tries of a transaction take less: the
#: SDK waits about 36 ms for a lost answer.
WATCHDOG_S = 0.24
#: Deceleration with which a motion is stopped, rad/s2.
STOP_ACCELERATION = 20.0


class DynamixelServo(Servo):
    """A servo with the control table of the X series.

    Args:
        bus: how to reach it.
        zero: position that counts as 0 rad, counts.

    Attributes:
        model: what it is.

    Raises:
        WrongServo: it is of a model that is not in the table, or of another kind of profile.
        ServoShutdown: it reports a hardware error.
        NotAnswering, DeviceGone: nobody is there.
    """

    _bus: Bus
    speed_step = SPEED_UNIT
    bytes_per_period = BYTES_PER_PERIOD

    def __init__(self, bus: Bus, zero: int = CENTRE) -> None:
        super().__init__(bus, zero)
        self._armed = False
        self.model = model = self._identify()
        self.name = f"DYNAMIXEL {model.name}"
        self.measures = "current" if model.senses == "motor" else "voltage"
        if model.senses == "motor":
            self.torque_constant = model.torque_constant
        else:
            self.torque_per_volt = model.torque_per_volt
        # a servo set to silence would look dead from here on; the setting is lost with its power
        bus.write_unanswered(STATUS_RETURN_LEVEL, 2)
        bus.raise_shutdown()
        bus.write(BUS_WATCHDOG, 0)  # it may still be tripped from the last time
        bus.write(TORQUE_ENABLE, 0)
        drive = bus.read(DRIVE_MODE)
        if drive & FOLLOWER:
            raise WrongServo("the servo is set to follow another one; clear bit 1 of its drive mode")
        self._found.change(DRIVE_MODE, drive & ~(TIME_PROFILE | TORQUE_ON_BY_GOAL))

    def _identify(self) -> Model:
        number = self._bus.ping()
        if number not in MODELS:
            known = ", ".join(model.name for model in MODELS.values())
            raise WrongServo(
                f"the device with id {self._bus.id} has model number {number}, "
                f"which is none of {known}; check the id"
            )
        return MODELS[number]

    # ----------------------------------------------------------------- what it is set to

    @property
    def return_delay_s(self) -> float:
        return self._bus.read(RETURN_DELAY) * RETURN_DELAY_UNIT

    @property
    def position_limits(self) -> tuple[float, float]:
        return (
            self._radians(self._bus.read(MIN_POSITION_LIMIT)),
            self._radians(self._bus.read(MAX_POSITION_LIMIT)),
        )

    @property
    def speed_limit(self) -> float:
        return self._bus.read(VELOCITY_LIMIT) * SPEED_UNIT

    @property
    def current_limit(self) -> float:
        """Its highest current, of the motor or of the supply, A; inf where it measures none."""
        if self.model.senses == "load":
            return math.inf
        return self._bus.read(CURRENT_LIMIT) * self.model.current_unit

    @property
    def duty_limit(self) -> float:
        return self._bus.read(PWM_LIMIT) * DUTY_UNIT

    @property
    def temperature_limit(self) -> float:
        return float(self._bus.read(TEMPERATURE_LIMIT))

    def limit(self, speed: float, current: float, duty: float) -> None:
        self._found.change(VELOCITY_LIMIT, math.ceil(speed / SPEED_UNIT))
        if math.isfinite(current):
            self._found.change(CURRENT_LIMIT, math.ceil(current / self.model.current_unit))
        self._found.change(PWM_LIMIT, round(duty / DUTY_UNIT))

    # ------------------------------------------------------------------------- motion

    def enter(self, mode: Mode, *, speed: float, current: float) -> None:
        """As every servo; the torque goes off for a moment, because it changes its mode only then."""
        if self.mode == mode:
            return
        self.torque_off()
        by_current = self.model.senses != "load"
        position_mode = CURRENT_BASED_POSITION_MODE if by_current else POSITION_MODE
        self._found.change(OPERATING_MODE, VELOCITY_MODE if mode == "velocity" else position_mode)
        # a change of mode resets these
        self._found.change(PROFILE_ACCELERATION, 0)
        self._found.setdefault(PROFILE_ACCELERATION, 0)
        if mode == "position":
            self._found.change(PROFILE_VELOCITY, math.ceil(speed / SPEED_UNIT))
            if by_current:
                limit = self._bus.read(CURRENT_LIMIT)
                wanted = limit if math.isinf(current) else math.ceil(current / self.model.current_unit)
                self._found.change(GOAL_CURRENT, min(wanted, limit))
            self._bus.write(GOAL_POSITION, self._bus.present().position)
        else:
            self._bus.write(GOAL_VELOCITY, 0)
        self._bus.write(TORQUE_ENABLE, 1)
        self.mode = mode

    def torque_off(self) -> None:
        self._bus.write(TORQUE_ENABLE, 0, alert=False)
        self.mode = None
        self._armed = False

    def accelerate_at(self, acceleration: float) -> None:
        self._found.change(PROFILE_ACCELERATION, min(max(round(acceleration / ACCELERATION_UNIT), 1), 32767))

    def move_at(self, speed: float) -> float:
        units = round(speed / SPEED_UNIT)
        self._bus.write(GOAL_VELOCITY, units)
        return units * SPEED_UNIT

    def move_to(self, position: float) -> float:
        counts = self._zero + round(position / COUNT_RAD)
        self._bus.write(GOAL_POSITION, counts)
        return self._radians(counts)

    def hold(self) -> None:
        # a tripped watchdog refuses the goal, and has stopped the axis itself
        with suppress(WatchdogTripped):
            if self.mode == "velocity":
                steepest = round(STOP_ACCELERATION / ACCELERATION_UNIT)
                self._bus.write(PROFILE_ACCELERATION, steepest, alert=False)
                self._bus.write(GOAL_VELOCITY, 0, alert=False)
            elif self.mode is not None:
                self._bus.write(GOAL_POSITION, self._bus.present(alert=False).position, alert=False)

    def read(self, *, alert: bool = True) -> Sample:
        now = self._bus.present(alert=alert)
        # the supply's current over the duty would be the motor's, but hardly at the small duties of a guided
        # axis
        by_current = self.model.senses == "motor"
        return Sample(
            now.time_s,
            self._radians(now.position),
            now.velocity * SPEED_UNIT,
            now.current * self.model.current_unit if by_current else None,
            float(now.temperature),
            now.voltage * VOLTAGE_UNIT,
            None if by_current else now.pwm * DUTY_UNIT,
        )

    def arm(self) -> None:
        """From now on the servo stops the axis by itself when it hears nothing for `WATCHDOG_S`."""
        if not self._armed:
            # as long for the computer where a virtual servo's time runs faster
            limit = WATCHDOG_S * max(self._bus.clock.scale, 1.0)
            self._bus.write(BUS_WATCHDOG, min(round(limit / WATCHDOG_UNIT), 127))
            self._armed = True

    def disarm(self) -> None:
        if self._armed:
            self._bus.write(BUS_WATCHDOG, 0, alert=False)
            self._armed = False

    # ---------------------------------------------------------------------- way out

    def release(self) -> None:
        self.torque_off()
        with suppress(NotAnswering, DeviceGone):
            self._bus.write(BUS_WATCHDOG, 0, alert=False)
            self._found.restore()


DYNAMIXEL = ServoKind(baud=57600, open_bus=Bus, servo=DynamixelServo)
