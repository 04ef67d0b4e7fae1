"""One DYNAMIXEL in SI units: made ready, moved, and put back as it was found.

Speeds are played in the velocity mode, positions in the current-based position mode, or in the position mode
of a servo that has no current mode. While the axis may move, the servo's own bus watchdog is armed.
"""

from __future__ import annotations

import math
from contextlib import suppress

from idtool.rig.base import Limits, Mode
from idtool.rig.bus.servo import CENTRE, COUNT_RAD, Servo, ServoKind
from idtool.rig.dynamixel import models
from idtool.rig.dynamixel.bus import BYTES_PER_PERIOD, Bus
from idtool.rig.faults import DeviceGone, NotAnswering, WatchdogTripped, WrongServo

#: The servo stops by itself when it hears nothing for so long, s. All tries of a transaction take less: the
#: SDK waits about 36 ms for a lost answer.
WATCHDOG_S = 0.24
#: Deceleration with which a motion is stopped, rad/s2.
STOP_ACCELERATION = 20.0


class DynamixelServo(Servo):
    """A servo with the control table of the X series.

    Attributes:
        model: what it is.

    Raises:
        WrongServo: it is of a model that is not in the table, or of another kind of profile.
        ServoShutdown: it reports a hardware error.
        NotAnswering, DeviceGone: nobody is there.
    """

    _bus: Bus
    speed_step, duty_unit = models.SPEED_UNIT, models.DUTY_UNIT
    return_delay = models.RETURN_DELAY
    bytes_per_period = BYTES_PER_PERIOD

    def __init__(self, bus: Bus, zero: int = CENTRE) -> None:
        super().__init__(bus, zero)
        self._armed = False
        self.model = model = self._identify()
        self.name, self.current_unit = f"DYNAMIXEL {model.name}", model.current_unit
        self.measures = "current" if model.senses == "motor" else "voltage"
        if model.senses == "motor":
            self.torque_constant = model.torque_constant
        else:
            self.torque_per_volt = model.torque_per_volt
        # a servo set to silence would look dead from here on; the setting is lost with its power
        bus.write_unanswered(models.STATUS_RETURN_LEVEL, 2)
        bus.raise_shutdown()
        bus.write(models.BUS_WATCHDOG, 0)  # it may still be tripped from the last time
        bus.write(models.TORQUE_ENABLE, 0)
        drive = bus.read(models.DRIVE_MODE)
        if drive & models.FOLLOWER:
            raise WrongServo("the servo is set to follow another one; clear bit 1 of its drive mode")
        self._found.change(models.DRIVE_MODE, drive & ~(models.TIME_PROFILE | models.TORQUE_ON_BY_GOAL))

    def _identify(self) -> models.Model:
        number = self._bus.ping()
        if number not in models.MODELS:
            known = ", ".join(model.name for model in models.MODELS.values())
            raise WrongServo(
                f"the device with id {self._bus.id} has model number {number}, "
                f"which is none of {known}; check the id"
            )
        return models.MODELS[number]

    # ----------------------------------------------------------------- what it is set to

    def own_limits(self) -> Limits:
        read = self._bus.read
        low, high = read(models.MIN_POSITION_LIMIT), read(models.MAX_POSITION_LIMIT)
        speed, current = read(models.VELOCITY_LIMIT) * models.SPEED_UNIT, math.inf
        if self.model.senses != "load":
            current = read(models.CURRENT_LIMIT) * self.current_unit
        return Limits(
            position=(self._radians(low), self._radians(high)),
            speed=speed,
            current=current,
            duty=read(models.PWM_LIMIT) * models.DUTY_UNIT,
            temperature=float(read(models.TEMPERATURE_LIMIT)),
        )

    def limit(self, speed: float, current: float, duty: float) -> None:
        self._found.change(models.VELOCITY_LIMIT, math.ceil(speed / models.SPEED_UNIT))
        if math.isfinite(current):
            self._found.change(models.CURRENT_LIMIT, math.ceil(current / self.current_unit))
        self._found.change(models.PWM_LIMIT, round(duty / models.DUTY_UNIT))

    # ------------------------------------------------------------------------- motion

    def enter(self, mode: Mode, *, speed: float, current: float) -> None:
        """As every servo; the torque goes off for a moment, because it changes its mode only then."""
        if self.mode == mode:
            return
        self.torque_off()
        by_current = self.model.senses != "load"
        position_mode = models.CURRENT_BASED_POSITION_MODE if by_current else models.POSITION_MODE
        wanted_mode = models.VELOCITY_MODE if mode == "velocity" else position_mode
        self._found.change(models.OPERATING_MODE, wanted_mode)
        # a change of mode resets these
        self._found.change(models.PROFILE_ACCELERATION, 0)
        self._found.setdefault(models.PROFILE_ACCELERATION, 0)
        if mode == "position":
            self._found.change(models.PROFILE_VELOCITY, math.ceil(speed / models.SPEED_UNIT))
            if by_current:
                limit = self._bus.read(models.CURRENT_LIMIT)
                wanted = limit if math.isinf(current) else math.ceil(current / self.current_unit)
                self._found.change(models.GOAL_CURRENT, min(wanted, limit))
            self._bus.write(models.GOAL_POSITION, self._bus.present().position)
        else:
            self._bus.write(models.GOAL_VELOCITY, 0)
        self._bus.write(models.TORQUE_ENABLE, 1)
        self.mode = mode

    def torque_off(self) -> None:
        self._bus.write(models.TORQUE_ENABLE, 0, alert=False)
        self.mode = None
        self._armed = False

    def accelerate_at(self, acceleration: float) -> None:
        units = round(acceleration / models.ACCELERATION_UNIT)
        self._found.change(models.PROFILE_ACCELERATION, min(max(units, 1), 32767))

    def move_at(self, speed: float) -> float:
        units = round(speed / models.SPEED_UNIT)
        self._bus.write(models.GOAL_VELOCITY, units)
        return units * models.SPEED_UNIT

    def move_to(self, position: float) -> float:
        counts = self._zero + round(position / COUNT_RAD)
        self._bus.write(models.GOAL_POSITION, counts)
        return self._radians(counts)

    def hold(self) -> None:
        # a tripped watchdog refuses the goal, and has stopped the axis itself
        with suppress(WatchdogTripped):
            if self.mode == "velocity":
                steepest = round(STOP_ACCELERATION / models.ACCELERATION_UNIT)
                self._bus.write(models.PROFILE_ACCELERATION, steepest, alert=False)
                self._bus.write(models.GOAL_VELOCITY, 0, alert=False)
            elif self.mode is not None:
                self._bus.write(models.GOAL_POSITION, self._bus.present(alert=False).position, alert=False)

    def arm(self) -> None:
        """From now on the servo stops the axis by itself when it hears nothing for `WATCHDOG_S`."""
        if not self._armed:
            # as long for the computer where a virtual servo's time runs faster
            limit = WATCHDOG_S * max(self._bus.clock.scale, 1.0)
            self._bus.write(models.BUS_WATCHDOG, min(round(limit / models.WATCHDOG_UNIT), 127))
            self._armed = True

    def disarm(self) -> None:
        if self._armed:
            self._bus.write(models.BUS_WATCHDOG, 0, alert=False)
            self._armed = False

    # ---------------------------------------------------------------------- way out

    def release(self) -> None:
        self.torque_off()
        with suppress(NotAnswering, DeviceGone):
            self._bus.write(models.BUS_WATCHDOG, 0, alert=False)
            self._found.restore()


DYNAMIXEL = ServoKind(baud=57600, open_bus=Bus, servo=DynamixelServo)
