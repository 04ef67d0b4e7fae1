"""One servo on the bus: transactions through the SDK, repeated where a packet was lost.

Every transaction is safe to repeat: a register is written to the same value again, or read again. Each
is done in its two halves, sending and receiving, because the SDK's whole functions drop what is needed
here: the status byte of a sync read, which holds the alert, and the length of an answer, which tells it
from a late one to another question.
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
from idtool.rig.faults import (
    DeviceGone,
    NotAnswering,
    ServoRefused,
    ServoRestarted,
    ServoShutdown,
    WatchdogTripped,
)

#: How often a transaction is tried. The SDK waits about 36 ms for a lost answer, and all tries together
#: must stay below the bus watchdog.
TRIES = 4

_ALERT = 0x80
_DAMAGED, _RANGE_ERROR = 3, 4
_REFUSALS = {
    1: "could not do it",
    2: "does not know the instruction",
    4: "says that the value is out of range",
    5: "says that the length is wrong",
    6: "says that the value is beyond its limit",
    7: "does not let it be written now",
}

#: Tick, (moving, moving status, PWM), current, velocity, position, (two trajectories), voltage,
#: temperature: addresses 120 to 146.
_BLOCK_ADDRESS, _BLOCK = 120, struct.Struct("<HBBhhiiiiHB")
#: The servo's count of milliseconds begins anew after this, s.
_TICKS_S = 32.768
#: How far the two clocks may disagree about the time between two readings: always, and as a share of it.
#: The first is less than an answer is ever late, the second far above any error of a quartz.
_TICK_SLACK_S, _CLOCK_ERROR = 0.025, 1e-3
#: How often it is looked for an answer, s.
_PAUSE_S = 1e-4
#: Bytes of an answer without data.
_ANSWER_BYTES = 11
_SYNC_READ_BYTES = 15
#: Bytes on the wire in one period: a goal and its answer, a sync read of the block and its answer.
BYTES_PER_PERIOD = 16 + _ANSWER_BYTES + _SYNC_READ_BYTES + _ANSWER_BYTES + _BLOCK.size
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
        clock: that one.
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
        self._asked = self._tick_at = 0.0
        self._tick: int | None = None
        self.clock = clock or HostClock()
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
        return int.from_bytes(self._ask(self._send_ping, 3, alert=False)[:2], "little")

    def read(self, register: Register) -> int:
        """A register; works in alert too.

        Raises:
            NotAnswering, DeviceGone, ServoRefused.
        """

        def send() -> int:
            return int(self._handler.readTx(self._port, self.id, register.address, register.size))

        data = self._ask(send, register.size, alert=False)
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
        self._ask(lambda: self._send_write(register, value), 0, alert=alert)

    def write_unanswered(self, register: Register, value: int) -> None:
        """Write a register of a servo that may be set to answer nothing but a ping.

        Raises:
            DeviceGone.
        """
        self._ask(lambda: self._send_write(register, value), None)

    def present(self, *, alert: bool = True) -> Present:
        """Position, velocity, current, voltage and temperature, all of one instant, in one transaction.

        Args:
            alert: raise if the servo reports a hardware error.

        Raises:
            ServoRestarted: its clock jumped.
            NotAnswering, DeviceGone, ServoRefused, ServoShutdown.
        """
        for _ in range(TRIES):
            data = self._ask(self._send_sync_read, _BLOCK.size, alert=alert)
            tick, _, _, _, current, velocity, position, _, _, voltage, temperature = _BLOCK.unpack(data)
            if self._is_fresh(tick):
                return Present(
                    self._asked + self._question_s, current, velocity, position, voltage, temperature
                )
            self.retries += 1
        self._tick = None
        raise ServoRestarted(
            "the servo's clock jumped: it lost its power for a moment, or another program talks to it; "
            "check supply and cable"
        )

    def _is_fresh(self, tick: int) -> bool:
        """Whether a reading belongs to the question, and not to one asked long before.

        The servo counts milliseconds; its count must have gone on as this computer's clock has.
        """
        if self._tick is not None:
            passed = self._asked - self._tick_at
            allowed = _TICK_SLACK_S * max(self.clock.scale, 1.0) + _CLOCK_ERROR * passed
            off = (1e-3 * (tick - self._tick) - passed) % _TICKS_S
            if min(off, _TICKS_S - off) > allowed:
                return False
        self._tick, self._tick_at = tick, self._asked
        return True

    # ------------------------------------------------------------------ instructions

    def _send_ping(self) -> int:
        packet = [0] * 10
        packet[4:8] = [self.id, 3, 0, 1]
        result = int(self._handler.txPacket(self._port, packet))
        self._port.setPacketTimeout(_ANSWER_BYTES + 3)
        return result

    def _send_write(self, register: Register, value: int) -> int:
        data = list(value.to_bytes(register.size, "little", signed=register.signed))
        result = int(self._handler.writeTxOnly(self._port, self.id, register.address, register.size, data))
        self._port.setPacketTimeout(_ANSWER_BYTES)
        return result

    def _send_sync_read(self) -> int:
        self._asked = self.clock.now()
        return int(self._handler.syncReadTx(self._port, _BLOCK_ADDRESS, _BLOCK.size, [self.id], 1, False))

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
        for _ in range(TRIES):
            # set by the SDK during a transaction, and left set where Ctrl-C ended one
            self._port.is_using = False
            try:
                sent = send()
                if size is None:
                    self._answer(0)
                    return b""
                answer = self._answer(size) if sent == self._sdk.COMM_SUCCESS else None
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

    def _wait_for_bytes(self) -> None:
        """Sleep until an answer begins or the time for it is over; the SDK itself would spin."""
        over = False
        while not over:
            # one look more when the time is over: the computer itself may have been busy elsewhere
            over = self._port.isPacketTimeout()
            self.clock.sleep(_PAUSE_S)
            if self._port.getBytesAvailable():
                return

    def _answer(self, size: int) -> tuple[int, bytes] | None:
        """Error byte and data of the answer; None where it is lost, damaged or to another question.

        An answer to an earlier question, which came too late, is told by its length, which the SDK's own
        reading functions do not look at.
        """
        self._wait_for_bytes()
        packet, result = self._handler.rxPacket(self._port, False)
        if result != self._sdk.COMM_SUCCESS or packet[4] != self.id:
            return None
        length = int.from_bytes(bytes(packet[5:7]), "little")
        error, data = packet[8], bytes(packet[9 : 5 + length])
        if error & ~_ALERT == _DAMAGED or (not error & ~_ALERT and len(data) != size):
            return None
        return error, data

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
