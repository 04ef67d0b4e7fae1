"""One servo on the bus: transactions through the SDK, repeated where a packet was lost.

Every transaction is safe to repeat: a register is written to the same value again, or read again. Sync
read is done in its two halves because the SDK's group class drops the status byte, which holds the alert.
Checked against dynamixel-sdk 4.1.0.
"""

from __future__ import annotations

import errno
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from idtool.errors import InputError, RigFault
from idtool.rig.clock import Clock, HostClock
from idtool.rig.dynamixel.models import BUS_WATCHDOG, HARDWARE_ERROR, Register, hardware_error_text
from idtool.rig.faults import DeviceGone, NotAnswering, ServoRefused, ServoShutdown, WatchdogTripped

#: How often a transaction is tried. The SDK waits about 36 ms for a lost answer, and all tries together
#: must stay below the bus watchdog.
TRIES = 4

_ALERT = 0x80
_RANGE_ERROR = 4
_REFUSALS = {
    1: "could not do it",
    2: "does not know the instruction",
    3: "got it damaged",
    4: "says that the value is out of range",
    5: "says that the length is wrong",
    6: "says that the value is beyond its limit",
    7: "does not let it be written now",
}

#: Current, velocity, position, (two trajectories), voltage, temperature: addresses 126 to 146.
_BLOCK_ADDRESS, _BLOCK = 126, struct.Struct("<hiiiiHB")
_SYNC_READ_BYTES = 15
#: Bytes on the wire in one period: a goal and its answer, a sync read of the block and its answer.
BYTES_PER_PERIOD = 16 + 11 + _SYNC_READ_BYTES + 11 + _BLOCK.size
#: Bits on the wire per byte: start, eight, stop.
BITS_PER_BYTE = 10


@dataclass(frozen=True)
class Present:
    """What the servo measured, in its own units, and when (s, of the bus's clock)."""

    time_s: float
    current: int
    velocity: int
    position: int
    voltage: int
    temperature: int


def import_sdk() -> Any:
    """The SDK, which is an extra of this package.

    Raises:
        RigFault: it is not installed.
    """
    try:
        import dynamixel_sdk
    except ImportError as error:
        raise RigFault(
            "a DYNAMIXEL servo needs the manufacturer's SDK; install it with: pip install 'ffc-id[dynamixel]'"
        ) from error
    return dynamixel_sdk


class Bus:
    """A serial port and one servo on it.

    Args:
        device: the port.
        id: of the servo.
        baud: bits a second.
        clock: tells when the servo measured.

    Attributes:
        retries: packets that were lost or damaged and asked for again.

    Raises:
        InputError: the SDK has no such baud rate.
        DeviceGone: the port cannot be opened.
        RigFault: the SDK is not installed.
    """

    def __init__(self, device: str, id: int, baud: int, clock: Clock | None = None) -> None:
        sdk = import_sdk()
        self.device, self.id, self.baud = device, id, baud
        self.retries = 0
        self._clock = clock or HostClock()
        # the servo measures when the last byte of the question has arrived
        self._question_s = _SYNC_READ_BYTES * BITS_PER_BYTE / baud
        self._sdk: Any = sdk
        self._port: Any = open_port(sdk, device, baud)
        self._handler: Any = sdk.Protocol2PacketHandler()

    def ping(self) -> int:
        """The model number.

        Raises:
            NotAnswering, DeviceGone.
        """
        model: int = self._try(lambda: self._handler.ping(self._port, self.id), alert=False)
        return model

    def read(self, register: Register) -> int:
        """A register; works in alert too.

        Raises:
            NotAnswering, DeviceGone, ServoRefused.
        """

        def transact() -> tuple[bytes, int, int]:
            data, result, error = self._handler.readTxRx(self._port, self.id, register.address, register.size)
            return self._whole(data, register.size, result, error)

        data: bytes = self._try(transact, alert=False)
        return int.from_bytes(data, "little", signed=register.signed)

    def write(self, register: Register, value: int, *, alert: bool = True) -> None:
        """Write a register.

        Args:
            register: which.
            value: in the servo's units.
            alert: raise if the servo reports a hardware error.

        Raises:
            NotAnswering, DeviceGone, ServoRefused, ServoShutdown, WatchdogTripped.
        """
        data = list(value.to_bytes(register.size, "little", signed=register.signed))

        def transact() -> tuple[None, int, int]:
            return None, *self._handler.writeTxRx(self._port, self.id, register.address, register.size, data)

        self._try(transact, alert=alert)

    def write_unanswered(self, register: Register, value: int) -> None:
        """Write a register of a servo that may be set to answer nothing but a ping.

        Raises:
            DeviceGone.
        """
        data = list(value.to_bytes(register.size, "little", signed=register.signed))

        def transact() -> tuple[None, int, int]:
            result = self._handler.writeTxOnly(self._port, self.id, register.address, register.size, data)
            return None, result, 0

        self._try(transact)

    def present(self) -> Present:
        """Position, velocity, current, voltage and temperature, all of one instant, in one transaction.

        Raises:
            NotAnswering, DeviceGone, ServoRefused, ServoShutdown.
        """

        asked = 0.0

        def transact() -> tuple[bytes, int, int]:
            nonlocal asked
            asked = self._clock.now()
            result = self._handler.syncReadTx(self._port, _BLOCK_ADDRESS, _BLOCK.size, [self.id], 1, False)
            if result != self._sdk.COMM_SUCCESS:
                return b"", result, 0
            return self._whole(*self._reordered(self._handler.readRx(self._port, self.id, _BLOCK.size)))

        current, velocity, position, _, _, voltage, temperature = _BLOCK.unpack(self._try(transact))
        return Present(asked + self._question_s, current, velocity, position, voltage, temperature)

    @staticmethod
    def _reordered(answer: tuple[list[int], int, int]) -> tuple[list[int], int, int, int]:
        data, result, error = answer
        return data, _BLOCK.size, result, error

    def _whole(self, data: list[int], size: int, result: int, error: int) -> tuple[bytes, int, int]:
        """An answer that came too late to an earlier question has another length: ask again."""
        if result == self._sdk.COMM_SUCCESS and not error & ~_ALERT and len(data) != size:
            result = self._sdk.COMM_RX_CORRUPT
        return bytes(data), result, error

    def close(self) -> None:
        """Let go of the port; safe to call twice."""
        try:
            self._port.closePort()
        except Exception:  # the device is gone; there is nothing to let go of
            return

    def _try(self, transact: Callable[[], tuple[Any, int, int]], *, alert: bool = True) -> Any:
        """Do a transaction until it succeeds; its answer without result and error."""
        for _ in range(TRIES):
            # set by the SDK during a transaction, and left set where Ctrl-C ended one
            self._port.is_using = False
            try:
                answer, result, error = transact()
            except Exception as gone:  # the SDK lets OSError, termios.error and others of a dead port through
                raise DeviceGone(
                    f"{self.device} has disappeared ({gone}); plug the adapter in and start again"
                ) from gone
            if result == self._sdk.COMM_SUCCESS:
                self._check(error, alert)
                return answer
            self.retries += 1
        raise NotAnswering(
            f"the servo with id {self.id} on {self.device} does not answer at {self.baud} baud; "
            "check power, cable, id and baud rate"
        )

    def _check(self, error: int, alert: bool) -> None:
        code = error & ~_ALERT
        if error & _ALERT and alert:
            self.raise_shutdown()
        if code == _RANGE_ERROR and self.read(BUS_WATCHDOG) < 0:
            raise WatchdogTripped(
                "the servo's watchdog stopped the axis because it heard nothing for too long; "
                "the computer was busy or the cable is loose"
            )
        if code:
            raise ServoRefused(f"the servo {_REFUSALS.get(code, f'answers with error {code}')}")

    def raise_shutdown(self) -> None:
        """Raise if a hardware error is set.

        Raises:
            ServoShutdown: it is.
        """
        bits = self.read(HARDWARE_ERROR)
        if bits:
            raise ServoShutdown(
                f"the servo reports {hardware_error_text(bits)} and may have switched its motor off; "
                "remove the cause, then switch its power off and on"
            )


def open_port(sdk: Any, device: str, baud: int) -> Any:
    """An open port of the SDK, for this process alone.

    Raises:
        InputError: the SDK has no such baud rate.
        DeviceGone: the device cannot be opened, or another program has it.
    """
    port = sdk.PortHandler(device)
    try:
        known = port.setBaudRate(baud)
    except Exception as error:  # SerialException, or what the system says of the device
        raise DeviceGone(f"cannot open {device}: {_why_not(error)}") from error
    if not known:
        raise InputError(
            f"the SDK has no baud rate {baud}",
            remedy="take 57600, 115200, 1000000, 2000000, 3000000 or 4000000",
        )
    try:
        port.ser.exclusive = True  # the SDK opens a port that another program has just as well
    except Exception as error:
        port.closePort()
        raise DeviceGone(f"{device} is in use by another program; end that first") from error
    return port


def _why_not(error: Exception) -> str:
    return {
        errno.EACCES: "no permission; add yourself to the group of the device (see docs/hardware.md)",
        errno.EPERM: "no permission; add yourself to the group of the device (see docs/hardware.md)",
        errno.EBUSY: "it is in use by another program; end that first",
        errno.ENOENT: "there is no such device; is the adapter plugged in?",
    }.get(getattr(error, "errno", None) or 0, "it is no serial port that answers; check the path")
