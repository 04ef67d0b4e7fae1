"""Transactions through a vendor's SDK, repeated where a packet was lost.

Every transaction is safe to repeat: a register is written to the same value again, or read again. Each
is done in its two halves, sending and receiving, because the SDK's whole functions drop what is needed
here: the status byte of every answer, and its length, which tells it from a late one to another question.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from idtool.rig.clock import Clock, HostClock
from idtool.rig.faults import DeviceGone, NotAnswering, shutdown

#: How often a transaction is tried.
TRIES = 4
#: How often it is looked for an answer, s.
_PAUSE_S = 1e-4
#: Bits on the wire per byte: start, eight, stop.
BITS_PER_BYTE = 10


@dataclass(frozen=True)
class Register(ABC):
    """An entry of a servo's table: address and size, bytes; how it writes a sign, its vendor says."""

    address: int
    size: int

    @abstractmethod
    def encode(self, value: int) -> bytes:
        """The bytes of a number."""

    @abstractmethod
    def decode(self, data: bytes) -> int:
        """The number of the bytes."""


class Present(NamedTuple):
    """What a servo measured, in its own units, and when (s, of the bus's clock).

    `current` is 0 of a servo that reports none, and the load on one without a current sensor.
    """

    time_s: float
    position: int
    speed: int
    duty: int
    voltage: int
    temperature: int
    current: int = 0


class Transactions(ABC):
    """A serial port and one servo on it.

    Args:
        port, handler: of the SDK.
        success: its result of a packet that was sent or received.
        device, id, baud: how the servo is reached (port, number, bits a second), for messages.
        clock: tells when the servo measured; None is the host's.

    Attributes:
        clock: that one.
        retries: packets that were lost or damaged and asked for again.
        patience_s: how long a servo that stands without torque may take to answer at all, s; where it moves,
            no longer than `TRIES`.
    """

    #: Where a servo of the vendor tells its hardware errors, and the words of the bits there.
    _status: ClassVar[Register]
    _errors: ClassVar[Mapping[int, str]]

    def __init__(
        self, port: Any, handler: Any, success: int, device: str, id: int, baud: int, clock: Clock | None
    ) -> None:
        self._port, self._handler, self._success = port, handler, success
        self.device, self.id, self.baud = device, id, baud
        self.clock = clock or HostClock()
        self.retries = 0
        self.patience_s = 0.0

    @abstractmethod
    def present(self, *, alert: bool = True) -> Present:
        """All that it measures, of one instant, in one transaction.

        Args:
            alert: raise if the servo reports a hardware error.

        Raises:
            ServoRestarted: it lost its power for a moment, or another program talks to it.
            NotAnswering, DeviceGone, ServoRefused, ServoShutdown.
        """

    def read(self, register: Register) -> int:
        """A register, in the servo's units; works in alert too.

        Raises:
            NotAnswering, DeviceGone, ServoRefused.
        """
        return register.decode(self._read(register.address, register.size, alert=False))

    def write(self, register: Register, value: int, *, alert: bool = True) -> None:
        """Write a register; `alert`: raise if the servo reports a hardware error.

        Raises:
            NotAnswering, DeviceGone, ServoRefused, ServoShutdown, WatchdogTripped.
        """
        self._write(register.address, register.encode(value), alert=alert)

    def write_unanswered(self, register: Register, value: int) -> None:
        """Write a register of a servo that may be set to answer nothing but a question.

        Raises:
            DeviceGone.
        """
        self._ask(lambda: self._send_write(register.address, register.encode(value)), None)

    def raise_shutdown(self, bits: int | None = None) -> None:
        """Raise if a hardware error is set.

        Args:
            bits: of the status; None asks for them.

        Raises:
            ServoShutdown: one is.
        """
        bits = self.read(self._status) if bits is None else bits
        if bits:
            raise shutdown(bits, self._errors)

    def _read(self, address: int, size: int, *, alert: bool) -> bytes:
        return self._ask(lambda: self._send_read(address, size), size, alert=alert)

    def _write(self, address: int, data: bytes, *, alert: bool) -> None:
        self._ask(lambda: self._send_write(address, data), 0, alert=alert)

    @abstractmethod
    def _send_read(self, address: int, size: int) -> int:
        """Ask for so many bytes; the SDK's result."""

    @abstractmethod
    def _send_write(self, address: int, data: bytes) -> int:
        """Write these bytes; the SDK's result."""

    def _sent(self, result: int, answer: int) -> int:
        """The SDK's result of a packet that it sent; an answer of so many bytes is waited for."""
        self._port.setPacketTimeout(answer)
        return int(result)

    @abstractmethod
    def _receive(self) -> tuple[int, int, bytes] | None:
        """Id, error byte and data of the packet that arrives; None where there is none, or a damaged one."""

    @abstractmethod
    def _fits(self, error: int, data: bytes, size: int) -> bool:
        """Whether an answer can be to a question that is answered by `size` bytes."""

    @abstractmethod
    def _check(self, error: int, alert: bool) -> None:
        """Raise what the error byte of an answer says; hardware errors only if `alert`."""

    def close(self) -> None:
        """Let go of the port; safe to call twice."""
        try:
            self._port.closePort()
        except Exception:  # the device is gone; there is nothing to let go of
            return

    def _ask(self, send: Callable[[], int], size: int | None, *, alert: bool = True) -> bytes:
        """Send an instruction until it is answered.

        Args:
            send: by the SDK; its result.
            size: bytes of data in the answer; None where there may be no answer at all.
            alert: raise if the servo reports a hardware error.

        Returns:
            The data.
        """
        begun, tries = self.clock.now(), 0
        while tries < TRIES or self.clock.now() - begun < self.patience_s * self.clock.scale:
            tries += 1
            # set by the SDK during a transaction, and left set where Ctrl-C ended one
            self._port.is_using = False
            try:
                sent = send()
                if size is None:
                    self._answer(0)
                    return b""
                answer = self._answer(size) if sent == self._success else None
            except Exception as gone:  # the SDK lets OSError, termios.error and others of a dead port through
                raise DeviceGone(
                    f"{self.device} has disappeared ({gone}); plug the adapter in and start again"
                ) from gone
            if answer is not None:
                error, data = answer
                self._check(error, alert)
                return data
            self.retries += 1
        raise NotAnswering(
            f"the servo with id {self.id} on {self.device} does not answer at {self.baud} baud; "
            "check power, cable, id and baud rate"
        )

    def _answer(self, size: int) -> tuple[int, bytes] | None:
        """Error byte and data of the answer; None where it is lost, damaged or to another question.

        An answer to an earlier question, which came too late, is told by its length, which the SDK's own
        reading functions do not look at.
        """
        self._wait_for_bytes()
        packet = self._receive()
        if packet is None:
            return None
        whose, error, data = packet
        return (error, data) if whose == self.id and self._fits(error, data, size) else None

    def _wait_for_bytes(self) -> None:
        """Sleep until an answer begins or the time for it is over; the SDK itself would spin."""
        allowed = 1e-3 * self._port.packet_timeout * self.clock.scale
        begun, over = self.clock.now(), False
        while not over:
            # one look more when the time is over: the computer itself may have been busy elsewhere
            over = self.clock.now() - begun > allowed
            self.clock.sleep(_PAUSE_S)
            if self._port.getBytesAvailable():
                return
