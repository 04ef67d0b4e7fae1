"""One DYNAMIXEL on the bus, through the manufacturer's SDK (Protocol 2.0).

Checked against dynamixel-sdk 4.1.0.
"""

from __future__ import annotations

import struct
from functools import partial

from idtool.rig.bus.port import import_sdk, open_port
from idtool.rig.bus.transactions import BITS_PER_BYTE, TRIES, Present, Transactions
from idtool.rig.clock import Clock
from idtool.rig.dynamixel.models import BUS_WATCHDOG, HARDWARE_ERROR, HARDWARE_ERRORS
from idtool.rig.faults import ServoRefused, ServoRestarted, WatchdogTripped

#: Baud rates that the servos come with or are set to.
BAUD_RATES = (57600, 1_000_000, 115200, 2_000_000, 3_000_000, 4_000_000)
#: The error byte of an answer: a bit for a hardware error, and numbers (ROBOTIS e-Manual, Protocol 2.0).
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
#: Bytes of an answer without data (header 4, id 1, length 2, instruction 1, error 1, CRC 2), and of the
#: question for a block (likewise without the error, and address 2, length 2, id 1).
_ANSWER_BYTES = 11
_SYNC_READ_BYTES = 15
#: Bytes on the wire in one period: a goal and its answer, a sync read of the block and its answer.
BYTES_PER_PERIOD = 16 + _ANSWER_BYTES + _SYNC_READ_BYTES + _ANSWER_BYTES + _BLOCK.size


#: The SDK; a `RigFault` where it is not installed.
vendor_sdk = partial(import_sdk, "dynamixel_sdk", "a DYNAMIXEL servo", "dynamixel")


class Bus(Transactions):
    """A serial port and one servo on it; arguments as of `Transactions`, errors as of `open_port`.

    Raises:
        RigFault: the SDK is not installed.
    """

    _status, _errors = HARDWARE_ERROR, HARDWARE_ERRORS

    def __init__(self, device: str, id: int, baud: int, clock: Clock | None = None) -> None:
        sdk = vendor_sdk()
        port = open_port(sdk, device, baud, BAUD_RATES)
        super().__init__(port, sdk.Protocol2PacketHandler(), sdk.COMM_SUCCESS, device, id, baud, clock)
        self._asked = self._tick_at = 0.0
        self._tick: int | None = None
        # the servo measures when the last byte of the question has arrived
        self._question_s = _SYNC_READ_BYTES * BITS_PER_BYTE / baud

    def ping(self) -> int:
        """The model number.

        Raises:
            NotAnswering, DeviceGone.
        """
        return int.from_bytes(self._ask(self._send_ping, 3, alert=False)[:2], "little")

    def present(self, *, alert: bool = True) -> Present:
        """As of every bus; a clock of the servo's that jumped is a restart."""
        for _ in range(TRIES):
            data = self._ask(self._send_sync_read, _BLOCK.size, alert=alert)
            tick, _, _, pwm, current, velocity, position, _, _, voltage, temperature = _BLOCK.unpack(data)
            if self._is_fresh(tick):
                measured = self._asked + self._question_s
                return Present(measured, position, velocity, pwm, voltage, temperature, current)
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
        return self._sent(self._handler.txPacket(self._port, packet), _ANSWER_BYTES + 3)

    def _send_read(self, address: int, size: int) -> int:
        return int(self._handler.readTx(self._port, self.id, address, size))

    def _send_write(self, address: int, data: bytes) -> int:
        result = self._handler.writeTxOnly(self._port, self.id, address, len(data), list(data))
        return self._sent(result, _ANSWER_BYTES)

    def _send_sync_read(self) -> int:
        self._asked = self.clock.now()
        return int(self._handler.syncReadTx(self._port, _BLOCK_ADDRESS, _BLOCK.size, [self.id], 1, False))

    def _receive(self) -> tuple[int, int, bytes] | None:
        packet, result = self._handler.rxPacket(self._port, False)
        if result != self._success:
            return None
        length = int.from_bytes(bytes(packet[5:7]), "little")
        return packet[4], packet[8], bytes(packet[9 : 5 + length])

    def _fits(self, error: int, data: bytes, size: int) -> bool:
        code = error & ~_ALERT
        return code != _DAMAGED and (code != 0 or len(data) == size)

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
