"""What every virtual servo has: an axis, a clock that passes, and what may go wrong with it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from idtool.virtual_servo.axis import VirtualAxis
from idtool.virtual_servo.decoder import Decoder

COUNT_RAD = 2.0 * math.pi / 4096
#: Position of the middle of a turn, counts: zero of the simulated axis.
CENTRE = 2048
#: Bit of an overload in the error status of either vendor.
OVERLOAD = 0x20


class VirtualServo(ABC):
    """One servo on the bus.

    Args:
        axis, decoder, table: see below.
        id, baud: its number, and its bits a second.
        now: the time at the start, s, in the clock of every later call.

    Attributes:
        baud_rates: what it can be set to, bits a second, by the code in its table.
        errors, fatal, delay: entries of its table: errors that are set, those that switch the torque off, and
            how long it waits before it answers, 2 us.
        axis: what it moves.
        table: its registers, by name.
        decoder: of the bytes that it hears.
        stuck: its encoder stands still.
        torque_since: when the torque was first switched on, None before that.
        heard: when it last heard an instruction.
    """

    baud_rates: ClassVar[Mapping[int, int]]
    errors: ClassVar[str]
    fatal: ClassVar[str]
    delay: ClassVar[str]
    axis: VirtualAxis
    table: Any
    decoder: Decoder
    stuck: bool = False
    torque_since: float | None = None
    heard: float

    def __init__(
        self, axis: VirtualAxis, decoder: Decoder, table: Any, *, id: int, baud: int, now: float
    ) -> None:
        self.axis, self.decoder, self.table = axis, decoder, table
        self._now = self.heard = now
        #: what a later instruction is to write, and where
        self._registered: tuple[int, bytes] | None = None
        limits = axis.file.limits
        table["id"] = id
        table["baud_rate"] = next(code for code, rate in self.baud_rates.items() if rate == baud)
        table["min_position_limit"] = max(0, CENTRE + round(limits["lowest_rad"] / COUNT_RAD))
        table["max_position_limit"] = min(4095, CENTRE + round(limits["highest_rad"] / COUNT_RAD))

    def _told_to_write(self, rest: bytes, length: int) -> Iterator[bytes]:
        """What of a sync write is for this servo: of each id, so many bytes."""
        for start in range(0, len(rest) - length, length + 1):
            if rest[start] == self.table["id"]:
                yield rest[start + 1 : start + 1 + length]

    def _move(self, until: float) -> None:
        """Let the axis move up to this instant."""
        if until > self._now:
            self.axis.advance(until - self._now)
            self._now = until

    @property
    def baud(self) -> int:
        """Its baud rate, bits a second."""
        return self.baud_rates[self.table["baud_rate"]]

    @property
    def return_delay_s(self) -> float:
        """How long it waits before it answers, s."""
        return 2e-6 * int(self.table[self.delay])

    @property
    @abstractmethod
    def torque(self) -> bool:
        """Whether its motor is on."""

    def pass_time(self, now: float) -> None:
        """Let the axis move up to this instant, and happen what is due on the way."""
        self._move(now)

    @abstractmethod
    def answer(self, packet: Any, now: float) -> list[Any]:
        """Do what an instruction says.

        Args:
            packet: from the bus, for whomever.
            now: s.

        Returns:
            The answers, in the order of the bus; none where none is due.
        """

    @staticmethod
    @abstractmethod
    def encode(packet: Any) -> bytes:
        """The bytes of a packet on the wire."""

    def reply(self, packet: Any, now: float) -> list[bytes]:
        """Do what an instruction says: the bytes of its answers, in the order of the bus."""
        return [self.encode(answer) for answer in self.answer(packet, now)]

    @abstractmethod
    def _drive(self) -> None:
        """Tell the drive what the table says."""

    @abstractmethod
    def _measure(self) -> None:
        """Bring the readings of the table up to date."""

    def fail(self, bits: int) -> None:
        """Set these bits of the error status; those of the servo's mask switch the torque off."""
        self.table[self.errors] |= bits
        if bits & self.table[self.fatal]:
            self.table["torque_enable"] = 0
            self._drive()

    def lose_power(self) -> None:
        """Begin anew: what is not stored for good has its initial value."""
        self.table.reboot()
        self._registered = None
        self._drive()
        self._measure()

    @abstractmethod
    def trip_watchdog(self) -> None:
        """Stop the axis as the watchdog does, where the servo has one."""
