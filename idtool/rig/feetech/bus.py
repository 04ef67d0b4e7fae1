"""One Feetech servo on the bus, through the manufacturer's SDK.

The protocol has no clock of the servo and no number of a packet, by which a late answer to an earlier
question could be told from the right one. So no two readings in a row ask for equally many bytes: they begin
at one of eight registers and all end at the last one that is of use. Checked against ftservo-python-sdk
2.0.1.
"""

from __future__ import annotations

from functools import partial

from idtool.rig.bus.port import import_sdk, open_port
from idtool.rig.bus.transactions import BITS_PER_BYTE, TRIES, Present, Transactions
from idtool.rig.clock import Clock
from idtool.rig.faults import ServoRestarted
from idtool.rig.feetech import models

#: Baud rates that the servos come with or are set to.
BAUD_RATES = (1_000_000, 500_000, 115_200)

#: Readings begin at one of these registers in turn and end with the current.
_BEGINS = range(33, 41)
_END = models.CURRENT.address + models.CURRENT.size
#: Bytes of a packet without parameters or data: header, id, length, instruction or error, checksum.
_FRAME = 6
_QUESTION = _FRAME + 2
_GOAL = models.ACCELERATION.size + models.GOAL_POSITION.size + models.GOAL_TIME.size + models.GOAL_SPEED.size
#: Bytes on the wire in one period: a goal and its answer, a reading and its answer.
BYTES_PER_PERIOD = _FRAME + 1 + _GOAL + _FRAME + _QUESTION + _FRAME + _END - _BEGINS[0]


#: The SDK; a `RigFault` where it is not installed.
vendor_sdk = partial(import_sdk, "scservo_sdk", "a Feetech servo", "feetech")


class Bus(Transactions):
    """A serial port and one servo on it; arguments as of `Transactions`, errors as of `open_port`.

    Attributes:
        torque: whether its torque was switched on here; a reading that says otherwise is a fault.

    Raises:
        RigFault: the SDK is not installed.
    """

    _status, _errors = models.STATUS, models.ERRORS

    def __init__(self, device: str, id: int, baud: int, clock: Clock | None = None) -> None:
        sdk = vendor_sdk()
        port = open_port(sdk, device, baud, BAUD_RATES)
        super().__init__(port, sdk.sms_sts(port), sdk.COMM_SUCCESS, device, id, baud, clock)
        self.torque = False
        self._goal: int | None = None
        self._turn = 0
        self._asked = 0.0
        self._question_s = _QUESTION * BITS_PER_BYTE / baud

    def ping(self) -> None:
        """Ask whether the servo is there.

        Raises:
            NotAnswering, DeviceGone.
        """
        self._ask(self._send_ping, 0, alert=False)

    def set_goal(self, position: int, speed: int, acceleration: int, *, alert: bool = True) -> None:
        """Position, speed and acceleration to get there with, all at once.

        Raises:
            NotAnswering, DeviceGone, ServoShutdown.
        """
        data = models.ACCELERATION.encode(acceleration) + models.GOAL_POSITION.encode(position)
        data += models.GOAL_TIME.encode(0) + models.GOAL_SPEED.encode(speed)
        self._goal = None  # an answer may be lost where the goal was not
        self._write(models.ACCELERATION.address, data, alert=alert)
        self._goal = position

    def present(self, *, alert: bool = True) -> Present:
        """As of every bus; torque that went off, or another goal than was given, is a restart."""
        for _ in range(TRIES):
            begin = _BEGINS[self._turn % len(_BEGINS)]
            self._turn += 1
            data = self._read(begin, _END - begin, alert=alert)

            def value(register: models.Register, data: bytes = data, begin: int = begin) -> int:
                at = register.address - begin
                return register.decode(data[at : at + register.size])

            if alert and value(models.STATUS):
                self.raise_shutdown(value(models.STATUS))
            torque_off = self.torque and not value(models.TORQUE_ENABLE)
            if not torque_off and self._goal in (None, value(models.GOAL_POSITION)):
                measured = self._asked + self._question_s
                read = (models.POSITION, models.SPEED, models.LOAD, models.VOLTAGE, models.TEMPERATURE)
                return Present(measured, *map(value, read))
            self.retries += 1
        if torque_off:
            raise ServoRestarted(
                "the servo's torque went off: it lost its power for a moment, or its protection tripped; "
                "check supply, cable and load"
            )
        raise ServoRestarted(
            "the servo has another goal than it was given: another program talks to it, or it lost its power "
            "for a moment"
        )

    # ------------------------------------------------------------------ instructions

    def _send_ping(self) -> int:
        packet = [0] * _FRAME
        packet[2:5] = [self.id, 2, 1]
        return self._sent(self._handler.txPacket(packet), _FRAME)

    def _send_read(self, address: int, size: int) -> int:
        self._asked = self.clock.now()
        return int(self._handler.readTx(self.id, address, size))

    def _send_write(self, address: int, data: bytes) -> int:
        return self._sent(self._handler.writeTxOnly(self.id, address, len(data), list(data)), _FRAME)

    def _receive(self) -> tuple[int, int, bytes] | None:
        packet, result = self._handler.rxPacket()
        if result != self._success:
            return None
        return packet[2], packet[4], bytes(packet[5 : 3 + packet[3]])

    def _fits(self, error: int, data: bytes, size: int) -> bool:
        return len(data) == size

    def _check(self, error: int, alert: bool) -> None:
        if error and alert:
            self.raise_shutdown(error)
