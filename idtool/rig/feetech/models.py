"""The registers of Feetech's STS and SMS series, and what their numbers mean.

Source: Feetech, "Magnetic encoder STS servo, memory table" (doc.feetech.cn, FT-SMS-STS-emanual) and the
manufacturer's SDK (ftservo-python-sdk, `sms_sts`); model numbers: github.com/huggingface/lerobot,
src/lerobot/motors/feetech/tables.py. Numbers with a sign are sign and magnitude: the sign is one bit above
the magnitude, not two's complement.

Register 60, "present load", is the duty of the motor's bridge in 0.1 %. Register 69, "present current", is
given in 6.5 mA without a word on whose current it is, so nothing here takes it for the motor's.
"""

from __future__ import annotations

from dataclasses import dataclass

from idtool.rig.bus import transactions
from idtool.rig.bus.servo import COUNT_RAD

#: rad/s per count a second.
SPEED_UNIT = COUNT_RAD
#: Speeds of a servo whose phase register lacks this bit are in 50 counts a second (0.732 rev/min).
FINE_SPEED_BIT, COARSE = 0x04, 50
#: rad/s2 per unit of acceleration: 100 counts/s2.
ACCELERATION_UNIT = 100 * COUNT_RAD
#: Share of the supply per unit of load and torque limit.
DUTY_UNIT = 1e-3

#: By model number; another one of the series is driven too, and called by its number.
MODELS = {777: "STS3215", 2825: "STS3250", 11272: "SM8512BL"}


@dataclass(frozen=True)
class Register(transactions.Register):
    """An entry of the memory table; `sign`: which bit is the sign, if any."""

    sign: int | None = None

    def encode(self, value: int) -> bytes:
        """The bytes of a number.

        >>> Register(46, 2, 15).encode(-2).hex()
        '0280'
        """
        if self.sign is not None and value < 0:
            value = -value | 1 << self.sign
        return value.to_bytes(self.size, "little")

    def decode(self, data: bytes) -> int:
        value = int.from_bytes(data, "little")
        if self.sign is None or not value & 1 << self.sign:
            return value
        return -(value & ~(1 << self.sign))


#: 0 on STS and SMS; the SCS series stores its high byte first and has another table.
BYTE_ORDER = Register(2, 1)
MODEL = Register(3, 2)
RETURN_DELAY = Register(7, 1)
STATUS_LEVEL = Register(8, 1)
MIN_POSITION_LIMIT = Register(9, 2)
MAX_POSITION_LIMIT = Register(11, 2)
TEMPERATURE_LIMIT = Register(13, 1)
PHASE = Register(18, 1)
OPERATING_MODE = Register(33, 1)
TORQUE_ENABLE = Register(40, 1)
ACCELERATION = Register(41, 1)
GOAL_POSITION = Register(42, 2, 15)
GOAL_TIME = Register(44, 2)
GOAL_SPEED = Register(46, 2, 15)
TORQUE_LIMIT = Register(48, 2)
POSITION = Register(56, 2, 15)
SPEED = Register(58, 2, 15)
LOAD = Register(60, 2, 10)
VOLTAGE = Register(62, 1)
TEMPERATURE = Register(63, 1)
STATUS = Register(65, 1)
CURRENT = Register(69, 2, 15)

#: Operating mode: positions.
POSITION_MODE = 0
#: Highest speed that the table takes, counts a second.
HIGHEST_SPEED = 3400

#: Bits of the status.
ERRORS = {
    0x01: "supply voltage out of range",
    0x02: "motor encoder fault",
    0x04: "overheating",
    0x08: "too much current",
    0x10: "angle out of range",
    0x20: "overload",
}
