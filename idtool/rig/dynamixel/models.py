"""The servos that the backend knows, and what their numbers mean.

Source: ROBOTIS e-Manual, emanual.robotis.com/docs/en/dxl/x/<model> and /mx/<model>-2: "Specifications" (stall
torque and current at the recommended voltage) and "Control Table" (units). The model numbers are those of the
control tables and of ROBOTIS' own list (github.com/ROBOTIS-GIT/dynamixel_hardware_interface,
param/dxl_model/dynamixel.model); the XD series has the motors of the XH series (its pages show their graphs).

What register 126 holds the manual does not say alike. On XM, XH, XW, XD and MX it is the current in the
motor's coil (ROBOTIS in github.com/ROBOTIS-GIT/DynamixelSDK/issues/433, of an XH540; of XW, XD and MX it is
taken to be so). On XL330 and XC330 it is the current of the supply (found from measurements:
github.com/Rhoban/bam/issues/14), and on XL430, XC430 and MX-28 an inferred load without a unit: there the
duty, register 124, times the voltage stands for the torque. Another model with this control table is one more
line.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from idtool.rig.bus import transactions

#: rad/s per unit of velocity: 0.229 rev/min.
SPEED_UNIT = 0.229 * 2.0 * math.pi / 60.0
#: rad/s2 per unit of profile acceleration: 214.577 rev/min2.
ACCELERATION_UNIT = 214.577 * 2.0 * math.pi / 3600.0
#: Share of the supply per unit of PWM: 885 is all of it.
DUTY_UNIT = 1.0 / 885
#: s per unit of the bus watchdog.
WATCHDOG_UNIT = 0.02


@dataclass(frozen=True)
class Model:
    """One servo.

    Attributes:
        name: as the manufacturer writes it.
        stall_torque_nm, stall_current_a: at the OUTPUT shaft and at `stall_voltage_v`; their ratio is the
            torque constant, which therefore has the reducer inside the servo in it.
        stall_voltage_v: the recommended one.
        current_unit: A per unit of register 126.
        senses: what that register is: the current of the motor, that of the supply, or a load without a unit.
    """

    name: str
    stall_torque_nm: float
    stall_current_a: float
    stall_voltage_v: float
    current_unit: float = 2.69e-3
    senses: Literal["motor", "supply", "load"] = "motor"

    @property
    def torque_constant(self) -> float:
        """N m/A at the output shaft; a ratio of two rounded numbers, good to a few per cent."""
        return self.stall_torque_nm / self.stall_current_a

    @property
    def torque_per_volt(self) -> float:
        """N m/V at the output shaft, of a motor that stands; as rough."""
        return self.stall_torque_nm / self.stall_voltage_v


#: By model number.
MODELS: dict[int, Model] = {
    30: Model("MX-28(2.0)", 2.5, 1.4, 12.0, math.nan, "load"),
    311: Model("MX-64(2.0)", 6.0, 4.1, 12.0, 3.36e-3),
    321: Model("MX-106(2.0)", 8.4, 5.2, 12.0, 3.36e-3),
    1001: Model("XD430-T350", 3.4, 1.3, 12.0),
    1011: Model("XD430-T210", 2.5, 1.3, 12.0),
    1020: Model("XM430-W350", 4.1, 2.3, 12.0),
    1030: Model("XM430-W210", 3.0, 2.3, 12.0),
    1060: Model("XL430-W250", 1.4, 1.3, 11.1, math.nan, "load"),
    1070: Model("XC430-W150", 1.6, 1.4, 12.0, math.nan, "load"),
    1080: Model("XC430-W240", 1.9, 1.4, 12.0, math.nan, "load"),
    1100: Model("XH540-W270", 9.9, 4.9, 12.0),
    1101: Model("XD540-T270", 9.9, 4.9, 12.0),
    1110: Model("XH540-W150", 7.1, 4.9, 12.0),
    1111: Model("XD540-T150", 7.1, 4.9, 12.0),
    1120: Model("XM540-W270", 10.6, 4.4, 12.0),
    1130: Model("XM540-W150", 7.3, 4.4, 12.0),
    1140: Model("XH540-V270", 9.2, 2.4, 24.0),
    1150: Model("XH540-V150", 6.4, 2.4, 24.0),
    1170: Model("XW540-T260", 9.5, 4.9, 12.0),
    1180: Model("XW540-T140", 6.9, 4.9, 12.0),
    1190: Model("XL330-M077", 0.215, 1.47, 5.0, 1e-3, "supply"),
    1200: Model("XL330-M288", 0.52, 1.47, 5.0, 1e-3, "supply"),
    1210: Model("XC330-T181", 0.76, 0.80, 11.1, 1e-3, "supply"),
    1220: Model("XC330-T288", 0.92, 0.80, 11.1, 1e-3, "supply"),
    1230: Model("XC330-M181", 0.60, 1.80, 5.0, 1e-3, "supply"),
    1240: Model("XC330-M288", 0.93, 1.80, 5.0, 1e-3, "supply"),
}


@dataclass(frozen=True)
class Register(transactions.Register):
    """An entry of the control table; `signed`: it is two's complement."""

    signed: bool = False

    def encode(self, value: int) -> bytes:
        return value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, data: bytes) -> int:
        return int.from_bytes(data, "little", signed=self.signed)


RETURN_DELAY = Register(9, 1)
DRIVE_MODE = Register(10, 1)
OPERATING_MODE = Register(11, 1)
TEMPERATURE_LIMIT = Register(31, 1)
PWM_LIMIT = Register(36, 2)
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
VELOCITY_MODE, POSITION_MODE, CURRENT_BASED_POSITION_MODE = 1, 3, 5
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
