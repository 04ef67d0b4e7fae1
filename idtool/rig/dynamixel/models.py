"""The servos that the backend knows, and what their numbers mean.

Source: ROBOTIS e-Manual, emanual.robotis.com/docs/en/dxl/x/<model>: "Specifications" (stall torque and
current at the recommended voltage) and "Control Table" (units). Another model of the X series with
current feedback is one more line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

#: rad per count of position: 4096 counts a turn.
COUNT_RAD = 2.0 * math.pi / 4096
#: rad/s per unit of velocity: 0.229 rev/min.
SPEED_UNIT = 0.229 * 2.0 * math.pi / 60.0
#: rad/s2 per unit of profile acceleration: 214.577 rev/min2.
ACCELERATION_UNIT = 214.577 * 2.0 * math.pi / 3600.0
#: A per unit of current.
CURRENT_UNIT = 2.69e-3
#: V per unit of supply voltage.
VOLTAGE_UNIT = 0.1
#: s per unit of the bus watchdog.
WATCHDOG_UNIT = 0.02
#: s per unit of the return delay time.
RETURN_DELAY_UNIT = 2e-6


@dataclass(frozen=True)
class Model:
    """One servo.

    Attributes:
        name: as the manufacturer writes it.
        stall_torque_nm, stall_current_a: at the OUTPUT shaft; their ratio is the torque constant, which
            therefore has the reducer inside the servo in it.
    """

    name: str
    stall_torque_nm: float
    stall_current_a: float

    @property
    def torque_constant(self) -> float:
        """N m/A at the output shaft; a ratio of two rounded numbers, good to a few per cent."""
        return self.stall_torque_nm / self.stall_current_a


#: By model number.
MODELS: dict[int, Model] = {
    1020: Model("XM430-W350", 4.1, 2.3),
    1030: Model("XM430-W210", 3.0, 2.3),
    1100: Model("XH540-W270", 9.9, 4.9),
    1110: Model("XH540-W150", 7.1, 4.9),
    1120: Model("XM540-W270", 10.6, 4.4),
    1130: Model("XM540-W150", 7.3, 4.4),
    1140: Model("XH540-V270", 9.2, 2.4),
    1150: Model("XH540-V150", 6.4, 2.4),
}


@dataclass(frozen=True)
class Register:
    """An entry of the control table: address and size, bytes, and whether it is two's complement."""

    address: int
    size: int
    signed: bool = False


RETURN_DELAY = Register(9, 1)
DRIVE_MODE = Register(10, 1)
OPERATING_MODE = Register(11, 1)
TEMPERATURE_LIMIT = Register(31, 1)
CURRENT_LIMIT = Register(38, 2)
VELOCITY_LIMIT = Register(44, 4)
MAX_POSITION_LIMIT = Register(48, 4)
MIN_POSITION_LIMIT = Register(52, 4)
TORQUE_ENABLE = Register(64, 1)
STATUS_RETURN_LEVEL = Register(68, 1)
HARDWARE_ERROR = Register(70, 1)
BUS_WATCHDOG = Register(98, 1, True)
GOAL_CURRENT = Register(102, 2, True)
GOAL_VELOCITY = Register(104, 4, True)
PROFILE_ACCELERATION = Register(108, 4)
PROFILE_VELOCITY = Register(112, 4)
GOAL_POSITION = Register(116, 4, True)

#: Operating modes.
VELOCITY_MODE, EXTENDED_POSITION_MODE, CURRENT_BASED_POSITION_MODE = 1, 4, 5
#: Bits of the drive mode: this servo follows another; profiles are given as times; a goal switches the
#: torque on.
FOLLOWER, TIME_PROFILE, TORQUE_ON_BY_GOAL = 0x02, 0x04, 0x08

#: Bits of the hardware error status.
HARDWARE_ERRORS = {
    0x01: "supply voltage out of range",
    0x04: "overheating",
    0x08: "motor encoder fault",
    0x10: "electrical shock or too little power",
    0x20: "overload",
}


def hardware_error_text(bits: int) -> str:
    """The hardware errors in words.

    >>> hardware_error_text(0x24)
    'overheating, overload'
    """
    words = [text for bit, text in HARDWARE_ERRORS.items() if bits & bit]
    return ", ".join(words) or f"unknown error 0x{bits:02x}"
