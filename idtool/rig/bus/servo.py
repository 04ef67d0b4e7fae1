"""What a servo on a bus can do: the interface between the rig and the two kinds of servo."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from idtool.rig.base import Limits, Measured, Mode, Sample
from idtool.rig.bus.transactions import Register, Transactions
from idtool.rig.clock import Clock
from idtool.rig.faults import ServoRefused

#: rad per count of position: 4096 counts a turn, of both vendors.
COUNT_RAD = 2.0 * math.pi / 4096
#: Middle of a turn, counts.
CENTRE = 2048
#: V per unit of supply voltage, and s per unit of the return delay, of both vendors.
_VOLTAGE_UNIT, _RETURN_DELAY_UNIT = 0.1, 2e-6


class Found(dict[Register, int]):
    """What was changed in a servo, and what was there before."""

    def __init__(self, bus: Transactions) -> None:
        super().__init__()
        self._bus = bus

    def change(self, register: Register, value: int) -> None:
        """Write a register, unless it has that value, and remember what was there first."""
        before = self._bus.read(register)
        if before != value:
            self.setdefault(register, before)
            self._bus.write(register, value)

    def restore(self) -> None:
        """Put everything back, in the order of the changes: a mode resets what was set after it."""
        for register, value in self.items():
            with suppress(ServoRefused):
                self._bus.write(register, value, alert=False)
        self.clear()


class Servo(ABC):
    """A servo, ready to move once a mode is entered. Whatever is changed in it, `release` puts back.

    Args:
        bus: how to reach it.
        zero: position that counts as 0 rad, counts.

    Attributes:
        name: vendor and model.
        measures: the motor's current, or the voltage at it.
        torque_constant, torque_per_volt: of the data sheet, N m/A and N m/V; None where it does not say.
        speed_step: commanded speeds are rounded to multiples of it, rad/s; measured ones come in it.
        duty_unit, current_unit: share of the supply, and A, per unit of duty and current.
        return_delay: where its table has the return delay.
        bytes_per_period: on the wire, of a goal, a reading and their answers.
        mode: in force; None while its torque is off.
    """

    name: str
    measures: Measured
    torque_constant: float | None = None
    torque_per_volt: float | None = None
    speed_step: float
    duty_unit: float
    current_unit: float = math.nan
    return_delay: Register
    bytes_per_period: int
    mode: Mode | None = None

    def __init__(self, bus: Transactions, zero: int = CENTRE) -> None:
        self._bus, self._zero = bus, zero
        self._found = Found(bus)

    def _radians(self, counts: int) -> float:
        return (counts - self._zero) * COUNT_RAD

    @property
    def return_delay_s(self) -> float:
        """How long it waits before it answers, s."""
        return self._bus.read(self.return_delay) * _RETURN_DELAY_UNIT

    @abstractmethod
    def own_limits(self) -> Limits:
        """What it is set to; a current is the motor's or the supply's, inf where it measures none."""

    @abstractmethod
    def limit(self, speed: float, current: float, duty: float) -> None:
        """Let the servo itself keep to these limits, rad/s, A and a share; only while its torque is off."""

    @abstractmethod
    def enter(self, mode: Mode, *, speed: float, current: float) -> None:
        """Take commands of this kind, standing where the axis is, with the torque on.

        Args:
            mode: speeds or positions.
            speed, current: that positions may be reached with, rad/s and A.
        """

    @abstractmethod
    def torque_off(self) -> None:
        """Switch the motor off; the axis is free."""

    @abstractmethod
    def accelerate_at(self, acceleration: float) -> None:
        """Limit the acceleration of speed commands, rad/s2."""

    @abstractmethod
    def move_at(self, speed: float) -> float:
        """Command a speed, rad/s; the speed commanded, which is a multiple of the servo's unit."""

    @abstractmethod
    def move_to(self, position: float) -> float:
        """Command a position, rad; the position commanded, which is a multiple of a count."""

    @abstractmethod
    def hold(self) -> None:
        """Come to rest and stay, also where the servo reports an error.

        Raises:
            RigFault: it could not be told.
        """

    def read(self, *, alert: bool = True) -> Sample:
        """Measure, at a time of the bus's clock; `alert`: raise if the servo reports a hardware error."""
        now = self._bus.present(alert=alert)
        # the supply's current over the duty would be the motor's, but hardly at the small duties of a guided
        # axis
        by_current = self.measures == "current"
        return Sample(
            now.time_s,
            self._radians(now.position),
            now.speed * self.speed_step,
            now.current * self.current_unit if by_current else None,
            float(now.temperature),
            now.voltage * _VOLTAGE_UNIT,
            None if by_current else now.duty * self.duty_unit,
        )

    @abstractmethod
    def arm(self) -> None:
        """From now on the servo brings the axis to rest by itself when it hears nothing more."""

    @abstractmethod
    def disarm(self) -> None:
        """Let silence pass; only where the axis stands."""

    @abstractmethod
    def release(self) -> None:
        """Torque off, and everything as it was found; what cannot be reached is left.

        Raises:
            RigFault: the torque could not be switched off.
        """


@dataclass(frozen=True)
class ServoKind:
    """How the servos of one vendor are reached.

    Attributes:
        baud: bits a second that they come with.
        open_bus: device, id, baud rate and clock -> the bus; raises InputError or RigFault.
        servo: the bus and the position that counts as 0 rad, counts -> the servo, made ready.
    """

    baud: int
    open_bus: Callable[[str, int, int, Clock], Any]
    servo: Callable[[Any, int], Servo]
