"""The virtual servo: instructions in, status packets out, and an axis that moves in between.

What it does follows the ROBOTIS e-Manual of the X series and of Protocol 2.0: the answers and their
error numbers, the status return level, the bus watchdog, the shutdown on a hardware error that only a
reboot ends. Of its firmware's control loops nothing is published; the drive is the plant's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

from idtool.rig import plant
from idtool.virtual_servo.axis import Drive, VirtualAxis
from idtool.virtual_servo.base import CENTRE, COUNT_RAD, VirtualServo
from idtool.virtual_servo.dynamixel.families import FAMILIES
from idtool.virtual_servo.dynamixel.packet import BROADCAST, STATUS, Damaged, Decoder, Packet, encode
from idtool.virtual_servo.dynamixel.table import (
    ACCESS_ERROR,
    CRC_ERROR,
    CURRENT_BASED,
    INSTRUCTION_ERROR,
    LENGTH_ERROR,
    RESULT_FAIL,
    ControlTable,
    Refused,
)

PING, READ, WRITE, REG_WRITE, ACTION, REBOOT = 0x01, 0x02, 0x03, 0x04, 0x05, 0x08
SYNC_READ, SYNC_WRITE = 0x82, 0x83

ALERT = 0x80

SPEED_UNIT = 0.229 * 2.0 * math.pi / 60.0
ACCELERATION_UNIT = 214.577 * 2.0 * math.pi / 3600.0
PWM_FULL = 885
WATCHDOG_S = 0.02
BAUD_RATES = {0: 9600, 1: 57600, 2: 115200, 3: 1_000_000, 4: 2_000_000, 5: 3_000_000, 6: 4_000_000}

#: Operating mode: speeds. Every other one that the table takes is of positions.
VELOCITY = 1


class VirtualDynamixel(VirtualServo):
    """One servo on the bus; `model`: its model number, 1150 is the XH540-V150-R."""

    baud_rates = BAUD_RATES
    errors, fatal, delay = "hardware_error_status", "shutdown", "return_delay_time"
    encode = staticmethod(encode)
    table: ControlTable

    def __init__(
        self, axis: VirtualAxis, *, id: int = 1, model: int = 1150, baud: int = 57600, now: float = 0.0
    ) -> None:
        self.family = FAMILIES[model]
        super().__init__(axis, Decoder(), ControlTable(self.family), id=id, baud=baud, now=now)
        self._began = now
        self._do: dict[int, Callable[[bytes], bytes]] = {
            PING: self._ping,
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._register,
            ACTION: self._act,
            REBOOT: self._reboot,
        }
        table, limits = self.table, axis.file.limits
        table["model_number"] = model
        table["velocity_limit"] = math.ceil(limits["speed_rad_s"] / SPEED_UNIT)
        table["present_input_voltage"] = round(10.0 * axis.file.motor.supply)
        if self.family.senses != "load":
            table["current_limit"] = math.ceil(limits["current_a"] / self.family.current_unit)
            table["goal_current"] = table["current_limit"]
        self._measure()

    @property
    def torque(self) -> bool:
        return bool(self.table["torque_enable"])

    def pass_time(self, now: float) -> None:
        """Let the axis move up to this instant, and the watchdog trip on the way."""
        limit = self.table["bus_watchdog"] * WATCHDOG_S
        trip = self.heard + limit
        if limit > 0.0 and self.table["torque_enable"] and now > trip:
            self._move(max(trip, self._now))
            self.trip_watchdog()
        self._move(now)

    def trip_watchdog(self) -> None:
        """Stop the axis; goals are read-only until the host clears the watchdog."""
        self.table["bus_watchdog"] = -1
        self.table["profile_acceleration"] = self.table["profile_velocity"] = 0
        self.table["goal_velocity"] = 0
        self._measure()
        self.table["goal_position"] = self.table["present_position"]
        self._drive()

    def answer(self, packet: Packet | Damaged, now: float) -> list[Packet]:
        self.pass_time(now)
        mine = packet.id == self.table["id"]
        if isinstance(packet, Damaged):
            return [self._status(CRC_ERROR)] if mine else []
        if not mine and packet.id != BROADCAST:
            return []
        self.heard = now
        if packet.instruction in (SYNC_READ, SYNC_WRITE):
            return self._sync(packet) if packet.id == BROADCAST else [self._status(INSTRUCTION_ERROR)]
        level = {PING: 0, READ: 1}.get(packet.instruction, 2)
        wanted = self.table["status_return_level"] >= level and (mine or packet.instruction == PING)
        try:
            status = self._status(0, self._do.get(packet.instruction, self._unknown)(packet.parameters))
        except Refused as refusal:
            status = self._status(refusal.code)
        return [status] if wanted else []

    def _status(self, error: int, data: bytes = b"") -> Packet:
        alert = ALERT if self.table["hardware_error_status"] else 0
        return Packet(self.table["id"], STATUS, bytes([error | alert]) + data)

    def _unknown(self, _: bytes) -> bytes:
        raise Refused(INSTRUCTION_ERROR)

    def _ping(self, _: bytes) -> bytes:
        return self.table.read(0, 2) + self.table.read(6, 1)

    def _read(self, parameters: bytes) -> bytes:
        if len(parameters) != 4:
            raise Refused(LENGTH_ERROR)
        self._measure()
        return self.table.read(*_address_and_length(parameters))

    def _sync(self, packet: Packet) -> list[Packet]:
        """A sync read or a sync write; only what names this servo concerns it."""
        address, length = _address_and_length(packet.parameters)
        rest = packet.parameters[4:]
        if packet.instruction == SYNC_READ:
            if self.table["id"] not in rest or not self.table["status_return_level"]:
                return []
            try:
                return [self._status(0, self._read(packet.parameters[:4]))]
            except Refused as refusal:
                return [self._status(refusal.code)]
        with suppress(Refused):  # nobody answers a sync write
            for data in self._told_to_write(rest, length):
                self._store(address, data)
        return []

    def _write(self, parameters: bytes) -> bytes:
        self._store(int.from_bytes(parameters[:2], "little"), parameters[2:])
        return b""

    def _register(self, parameters: bytes) -> bytes:
        address = int.from_bytes(parameters[:2], "little")
        self.table.check(address, parameters[2:])
        self._registered = (address, parameters[2:])
        self.table["registered_instruction"] = 1
        return b""

    def _act(self, _: bytes) -> bytes:
        if self._registered is None:
            raise Refused(INSTRUCTION_ERROR)
        waiting, self._registered = self._registered, None
        self.table["registered_instruction"] = 0
        self._store(*waiting)
        return b""

    def _reboot(self, _: bytes) -> bytes:
        self.lose_power()
        return b""

    def lose_power(self) -> None:
        """Begin anew: what is not in the EEPROM has its initial value, and the clock stands at zero."""
        self._began = self._now
        super().lose_power()

    def _store(self, address: int, data: bytes) -> None:
        values = self.table.check(address, data)
        if values.get("torque_enable") and self.table["hardware_error_status"] & self.table["shutdown"]:
            raise Refused(RESULT_FAIL)
        if "id" in values and values["id"] == self.table["secondary_id"]:
            raise Refused(ACCESS_ERROR)
        for name, value in values.items():
            if name == "torque_enable" and value and not self.table["torque_enable"]:
                self._measure()
                self.table["goal_position"] = self.table["present_position"]
                if self.torque_since is None:
                    self.torque_since = self._now
            self.table[name] = value
        self._drive()

    def _drive(self) -> None:
        table = self.table
        if not table["torque_enable"]:
            self.axis.command(Drive())
            return
        acceleration = table["profile_acceleration"] * ACCELERATION_UNIT or math.inf
        if table["operating_mode"] == VELOCITY:
            goal = table["goal_velocity"] * SPEED_UNIT
            self.axis.command(Drive(plant.VELOCITY_MODE, goal, acceleration=acceleration))
            return
        goal = (table["goal_position"] - CENTRE) * COUNT_RAD
        speed = table["profile_velocity"] * SPEED_UNIT or math.inf
        current = math.inf
        if table["operating_mode"] == CURRENT_BASED:
            current = abs(table["goal_current"]) * self.family.current_unit
        self.axis.command(Drive(plant.POSITION_MODE, goal, speed, current, acceleration))

    def _measure(self) -> None:
        table, reading = self.table, self.axis.read()
        table["realtime_tick"] = int(1000.0 * (self._now - self._began)) % 32768
        table["present_pwm"] = round(reading.duty * PWM_FULL)
        table["present_input_voltage"] = round(10.0 * reading.voltage)
        senses = {"motor": reading.current, "supply": reading.bus_current, "load": reading.duty}
        table["present_current"] = round(senses[self.family.senses] / self.family.current_unit)
        table["present_temperature"] = min(max(round(reading.temperature), 0), 255)
        if not self.stuck:
            table["present_velocity"] = round(reading.velocity / SPEED_UNIT)
            table["present_position"] = CENTRE + round(reading.position / COUNT_RAD)
        else:
            table["present_velocity"] = 0


def _address_and_length(parameters: bytes) -> tuple[int, int]:
    return int.from_bytes(parameters[:2], "little"), int.from_bytes(parameters[2:4], "little")
