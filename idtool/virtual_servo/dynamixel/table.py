"""The control table of an X-series servo: what may be read and written, and when.

Addresses, sizes, access and initial values are those of the ROBOTIS e-Manual (XH540-V150-R, "Control
Table"); the parts that have no effect on a simulated axis keep what is written to them.
"""

from __future__ import annotations

from dataclasses import dataclass

from idtool.virtual_servo.dynamixel.families import Family
from idtool.virtual_servo.entry import Entry, Table

#: Below this address the table is EEPROM and locked while the torque is on.
EEPROM_END = 64
SIZE = 147

# Error numbers of a status packet.
RESULT_FAIL, INSTRUCTION_ERROR, CRC_ERROR, RANGE_ERROR, LENGTH_ERROR, LIMIT_ERROR, ACCESS_ERROR = range(1, 8)

CURRENT_BASED = 5
#: Entries that a servo without a current sensor has not; register 126 holds its load.
CURRENT_ENTRIES = ("current_limit", "goal_current")

GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")


class Refused(Exception):  # noqa: N818 (an answer of the servo, not a fault of the program)
    """An instruction that the servo refuses, with the error number of its answer."""

    def __init__(self, code: int) -> None:
        super().__init__(f"error {code}")
        self.code = code


@dataclass(frozen=True)
class Field(Entry):
    """An entry; `signed`: two's complement."""

    signed: bool = False

    def encode(self, value: int) -> bytes:
        return value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, data: bytes) -> int:
        return int.from_bytes(data, "little", signed=self.signed)


_TURNS = 1_048_575  # extended position: 256 turns either way

FIELDS: dict[str, Field] = {
    "model_number": Field(0, 2, False),
    "model_information": Field(2, 4, False),
    "firmware_version": Field(6, 1, False, 45),
    "id": Field(7, 1, True, 1, (0, 252)),
    "baud_rate": Field(8, 1, True, 1, (0, 7)),
    "return_delay_time": Field(9, 1, True, 250, (0, 254)),
    "drive_mode": Field(10, 1, True, 0, (0, 15)),
    # current (0) and PWM (16) control are refused: the simulated drive has no such loop
    "operating_mode": Field(11, 1, True, 3, (1, 5)),
    "secondary_id": Field(12, 1, True, 255, (0, 255)),
    "protocol_type": Field(13, 1, True, 2, (2, 2)),
    "homing_offset": Field(20, 4, True, 0, (-1_044_479, 1_044_479), True),
    "moving_threshold": Field(24, 4, True, 10, (0, 1023)),
    "temperature_limit": Field(31, 1, True, 80, (0, 100)),
    "max_voltage_limit": Field(32, 2, True, 300, (110, 300)),
    "min_voltage_limit": Field(34, 2, True, 110, (110, 300)),
    "pwm_limit": Field(36, 2, True, 885, (0, 885)),
    "current_limit": Field(38, 2, True, 1188, (0, 2047)),
    "velocity_limit": Field(44, 4, True, 230, (0, 1023)),
    "max_position_limit": Field(48, 4, True, 4095, (0, 4095)),
    "min_position_limit": Field(52, 4, True, 0, (0, 4095)),
    "shutdown": Field(63, 1, True, 52, (0, 63)),
    "torque_enable": Field(64, 1, True, 0, (0, 1)),
    "led": Field(65, 1, True, 0, (0, 1)),
    "status_return_level": Field(68, 1, True, 2, (0, 2)),
    "registered_instruction": Field(69, 1, False),
    "hardware_error_status": Field(70, 1, False),
    "velocity_i_gain": Field(76, 2, True, 1920, (0, 16383)),
    "velocity_p_gain": Field(78, 2, True, 100, (0, 16383)),
    "position_d_gain": Field(80, 2, True, 0, (0, 16383)),
    "position_i_gain": Field(82, 2, True, 0, (0, 16383)),
    "position_p_gain": Field(84, 2, True, 800, (0, 16383)),
    "feedforward_2nd_gain": Field(88, 2, True, 0, (0, 16383)),
    "feedforward_1st_gain": Field(90, 2, True, 0, (0, 16383)),
    "bus_watchdog": Field(98, 1, True, 0, (0, 127), True),
    "goal_pwm": Field(100, 2, True, 885, (-885, 885), True),
    "goal_current": Field(102, 2, True, 1188, (-2047, 2047), True),
    "goal_velocity": Field(104, 4, True, 0, (-1023, 1023), True),
    "profile_acceleration": Field(108, 4, True, 0, (0, 32767)),
    "profile_velocity": Field(112, 4, True, 0, (0, 32767)),
    "goal_position": Field(116, 4, True, 0, (-_TURNS, _TURNS), True),
    "realtime_tick": Field(120, 2, False),
    "moving": Field(122, 1, False),
    "moving_status": Field(123, 1, False),
    "present_pwm": Field(124, 2, False, 0, None, True),
    "present_current": Field(126, 2, False, 0, None, True),
    "present_velocity": Field(128, 4, False, 0, None, True),
    "present_position": Field(132, 4, False, 0, None, True),
    "velocity_trajectory": Field(136, 4, False, 0, None, True),
    "position_trajectory": Field(140, 4, False, 0, None, True),
    "present_input_voltage": Field(144, 2, False, 240),
    "present_temperature": Field(146, 1, False, 25),
}

#: A goal may not exceed the limit that stands here, either way.
_LIMITED = {"goal_pwm": "pwm_limit", "goal_current": "current_limit", "goal_velocity": "velocity_limit"}
_BY_ADDRESS = {field.address: name for name, field in FIELDS.items()}


class ControlTable(Table):
    """The memory of one servo.

    Args:
        family: what its current is; a servo without a current sensor lacks the entries of one.
    """

    fields, size, eeprom_end = FIELDS, SIZE, EEPROM_END

    def __init__(self, family: Family) -> None:
        self._lacks = CURRENT_ENTRIES if family.senses == "load" else ()
        super().__init__()

    def reboot(self) -> None:
        """Back to the initial values, except what is in the EEPROM; the goal of a current is its limit."""
        super().reboot()
        if not self._lacks:
            self["goal_current"] = self["current_limit"]

    def read(self, address: int, length: int) -> bytes:
        """A stretch of the table.

        Raises:
            Refused: it reaches beyond the table.
        """
        if length == 0 or address + length > SIZE:
            raise Refused(ACCESS_ERROR)
        return bytes(self._memory[address : address + length])

    def check(self, address: int, data: bytes) -> dict[str, int]:
        """The entries that a write would change.

        Raises:
            Refused: one of them may not be written, now or at all.
        """
        values: dict[str, int] = {}
        while data:
            name = _BY_ADDRESS.get(address)
            if name is None or name in self._lacks or not FIELDS[name].writable:
                raise Refused(ACCESS_ERROR)
            field = FIELDS[name]
            if len(data) < field.size:
                raise Refused(LENGTH_ERROR)
            if address < EEPROM_END and self["torque_enable"]:
                raise Refused(ACCESS_ERROR)
            values[name] = field.decode(data[: field.size])
            self._check_value(name, field, values[name])
            address, data = address + field.size, data[field.size :]
        if not values:
            raise Refused(LENGTH_ERROR)
        return values

    def _check_value(self, name: str, field: Field, value: int) -> None:
        if name in GOALS and self["bus_watchdog"] < 0:
            raise Refused(RANGE_ERROR)  # read-only until the watchdog is cleared
        if name == "operating_mode" and value == CURRENT_BASED and self._lacks:
            raise Refused(RANGE_ERROR)
        if field.range is not None and not field.range[0] <= value <= field.range[1]:
            raise Refused(RANGE_ERROR)
        if name in _LIMITED and abs(value) > self[_LIMITED[name]]:
            raise Refused(LIMIT_ERROR)
        if name == "goal_position" and self["operating_mode"] == 3:
            low, high = self["min_position_limit"], self["max_position_limit"]
            if not low <= value <= high:
                raise Refused(LIMIT_ERROR)
