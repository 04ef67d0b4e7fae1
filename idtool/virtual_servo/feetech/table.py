"""The memory table of an STS servo: addresses, sizes, signs and initial values.

Source: Feetech, "Magnetic encoder STS servo, memory table". Numbers with a sign are a magnitude and, above
it, one bit for the sign. Values that do not fit a range are cut to it, as the servo does, which answers a
write without an error. Below address 40 the table is EEPROM: it keeps what is written through a loss of power
only while the lock (55) is off.
"""

from __future__ import annotations

from dataclasses import dataclass

from idtool.virtual_servo.entry import Entry, Table

#: Registers below this keep their value without power (Feetech, STS3215 memory table).
EEPROM_END = 40
SIZE = 87


@dataclass(frozen=True)
class Field(Entry):
    """An entry; `sign`: the bit of the sign, if it has one."""

    sign: int | None = None

    def encode(self, value: int) -> bytes:
        if self.sign is not None and value < 0:
            value = (1 << self.sign) - value
        return value.to_bytes(self.size, "little")

    def decode(self, data: bytes) -> int:
        value = int.from_bytes(data, "little")
        if self.sign is None or not value >> self.sign & 1:
            return value
        return -(value - (1 << self.sign))


FIELDS: dict[str, Field] = {
    "firmware_major": Field(0, 1, False, 3),
    "firmware_minor": Field(1, 1, False, 10),
    "byte_order": Field(2, 1, False, 0),
    "model": Field(3, 2, False, 777),
    "id": Field(5, 1, True, 1, (0, 253)),
    "baud_rate": Field(6, 1, True, 0, (0, 7)),
    "return_delay": Field(7, 1, True, 0, (0, 254)),
    "status_level": Field(8, 1, True, 1, (0, 1)),
    "min_position_limit": Field(9, 2, True, 0, (0, 4094)),
    "max_position_limit": Field(11, 2, True, 4095, (1, 4095)),
    "temperature_limit": Field(13, 1, True, 70, (0, 100)),
    "max_voltage_limit": Field(14, 1, True, 140, (0, 254)),
    "min_voltage_limit": Field(15, 1, True, 40, (0, 254)),
    "max_torque": Field(16, 2, True, 1000, (0, 1000)),
    "phase": Field(18, 1, True, 12, (0, 254)),
    "unloading": Field(19, 1, True, 44, (0, 254)),
    "led_alarm": Field(20, 1, True, 47, (0, 254)),
    "p_gain": Field(21, 1, True, 32, (0, 254)),
    "d_gain": Field(22, 1, True, 32, (0, 254)),
    "i_gain": Field(23, 1, True, 0, (0, 254)),
    "starting_force": Field(24, 2, True, 16, (0, 1000)),
    "dead_zone_cw": Field(26, 1, True, 1, (0, 32)),
    "dead_zone_ccw": Field(27, 1, True, 1, (0, 32)),
    "protection_current": Field(28, 2, True, 500, (0, 511)),
    "angular_resolution": Field(30, 1, True, 1, (1, 3)),
    "homing_offset": Field(31, 2, True, 0, (-2047, 2047), 11),
    "operating_mode": Field(33, 1, True, 0, (0, 3)),
    "protective_torque": Field(34, 1, True, 20, (0, 100)),
    "protection_time": Field(35, 1, True, 200, (0, 254)),
    "overload_torque": Field(36, 1, True, 80, (0, 100)),
    "speed_p_gain": Field(37, 1, True, 10, (0, 100)),
    "overcurrent_time": Field(38, 1, True, 200, (0, 254)),
    "speed_i_gain": Field(39, 1, True, 200, (0, 254)),
    "torque_enable": Field(40, 1, True, 0, (0, 128)),
    "acceleration": Field(41, 1, True, 0, (0, 254)),
    "goal_position": Field(42, 2, True, 0, (-32767, 32767), 15),
    "goal_time": Field(44, 2, True, 0, (0, 1000), 10),
    "goal_speed": Field(46, 2, True, 0, (-3400, 3400), 15),
    "torque_limit": Field(48, 2, True, 1000, (0, 1000)),
    "lock": Field(55, 1, True, 1, (0, 1)),
    "present_position": Field(56, 2, False, 0, None, 15),
    "present_speed": Field(58, 2, False, 0, None, 15),
    "present_load": Field(60, 2, False, 0, None, 10),
    "present_voltage": Field(62, 1, False, 120),
    "present_temperature": Field(63, 1, False, 25),
    "registered": Field(64, 1, False),
    "status": Field(65, 1, False),
    "moving": Field(66, 1, False),
    "present_current": Field(69, 2, False, 0, None, 15),
}

_BY_ADDRESS = {field.address: name for name, field in FIELDS.items()}


class MemoryTable(Table):
    """The memory of one servo."""

    fields, size, eeprom_end = FIELDS, SIZE, EEPROM_END

    def __init__(self) -> None:
        super().__init__()
        self.store()

    def store(self) -> None:
        """Keep the EEPROM as it is, for the time without power."""
        self._stored = bytes(self._memory[:EEPROM_END])

    def reboot(self) -> None:
        """Back to what was stored, and the rest to its initial values."""
        self._memory[:EEPROM_END] = self._stored
        super().reboot()
        self["torque_limit"] = self["max_torque"]

    def read(self, address: int, length: int) -> bytes:
        """A stretch of the table; zeros beyond its end."""
        return bytes(self._memory[address : address + length]).ljust(length, b"\0")

    def write(self, address: int, data: bytes) -> set[str]:
        """Write whole entries; what cannot be written is left. The names of those that were."""
        written = set()
        while data:
            name = _BY_ADDRESS.get(address)
            size = FIELDS[name].size if name else 1
            if name and FIELDS[name].writable and len(data) >= size:
                self._memory[address : address + size] = data[:size]
                low, high = FIELDS[name].range or (self[name], self[name])
                self[name] = min(max(self[name], low), high)
                written.add(name)
            address, data = address + size, data[size:]
        if not self["lock"] and any(FIELDS[name].address < EEPROM_END for name in written):
            self.store()
        return written
