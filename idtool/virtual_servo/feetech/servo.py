"""The virtual STS servo: instructions in, answers out, and an axis that moves in between.

What it does follows Feetech's protocol manual and memory table. Of its position loop nothing is published;
the drive is the plant's. Its speed is coarse, since the servo takes it from the counts of its encoder: 50
counts a second. Whose current register 69 is nobody says; here it is the supply's.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from idtool.rig import plant
from idtool.virtual_servo.axis import Drive, VirtualAxis
from idtool.virtual_servo.base import CENTRE, COUNT_RAD, VirtualServo
from idtool.virtual_servo.feetech.packet import BROADCAST, Decoder, Packet, encode
from idtool.virtual_servo.feetech.table import MemoryTable

PING, READ, WRITE, REG_WRITE, ACTION, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x04, 0x05, 0x82, 0x83

#: rad/s2 per unit of acceleration.
ACCELERATION_UNIT = 100 * COUNT_RAD
CURRENT_UNIT = 6.5e-3
#: Bit of the phase byte that makes the unit of speed a count a second, and what it is without.
FINE_SPEED_BIT, COARSE = 0x04, 50
BAUD_RATES = {0: 1_000_000, 1: 500_000, 2: 250_000, 3: 128_000, 4: 115_200, 5: 76_800, 6: 57_600, 7: 38_400}
POSITION, SPEED = 0, 1


class VirtualFeetech(VirtualServo):
    """One servo on the bus; `model`: its model number, 777 is the STS3215."""

    baud_rates = BAUD_RATES
    errors, fatal, delay = "status", "unloading", "return_delay"
    encode = staticmethod(encode)
    table: MemoryTable

    def __init__(
        self, axis: VirtualAxis, *, id: int = 1, model: int = 777, baud: int = 1_000_000, now: float = 0.0
    ) -> None:
        super().__init__(axis, Decoder(), MemoryTable(), id=id, baud=baud, now=now)
        self._do: dict[int, Callable[[bytes], bytes]] = {
            PING: lambda _: b"",
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._register,
            ACTION: self._act,
        }
        self.table["model"] = model
        self.table.store()
        self._measure()

    @property
    def torque(self) -> bool:
        return self.table["torque_enable"] == 1

    def trip_watchdog(self) -> None:
        """Nothing: the series has none."""

    def answer(self, packet: Packet, now: float) -> list[Packet]:
        self.pass_time(now)
        mine = packet.id == self.table["id"]
        if not mine and packet.id != BROADCAST:
            return []
        self.heard = now
        if packet.code in (SYNC_READ, SYNC_WRITE):
            return self._sync(packet)
        act = self._do.get(packet.code)
        if act is None:
            return []
        silent = packet.id == BROADCAST and packet.code != PING
        if packet.code not in (PING, READ) and not self.table["status_level"]:
            silent = True
        data = act(packet.parameters)
        return [] if silent else [self._status(data)]

    def _status(self, data: bytes = b"") -> Packet:
        return Packet(self.table["id"], self.table["status"], data)

    def _read(self, parameters: bytes) -> bytes:
        if len(parameters) != 2:
            return b""
        self._measure()
        return self.table.read(*parameters)

    def _sync(self, packet: Packet) -> list[Packet]:
        """A sync read or a sync write; only what names this servo concerns it."""
        if len(packet.parameters) < 2:
            return []
        address, length = packet.parameters[:2]
        rest = packet.parameters[2:]
        if packet.code == SYNC_READ:
            return [self._status(self._read(packet.parameters[:2]))] if self.table["id"] in rest else []
        for data in self._told_to_write(rest, length):
            self._store(address, data)
        return []

    def _write(self, parameters: bytes) -> bytes:
        if parameters:
            self._store(parameters[0], parameters[1:])
        return b""

    def _register(self, parameters: bytes) -> bytes:
        if parameters:
            self._registered = parameters[0], parameters[1:]
            self.table["registered"] = 1
        return b""

    def _act(self, _: bytes) -> bytes:
        waiting, self._registered = self._registered, None
        self.table["registered"] = 0
        if waiting is not None:
            self._store(*waiting)
        return b""

    def _store(self, address: int, data: bytes) -> None:
        was_on = self.torque
        written = self.table.write(address, data)
        if self.torque and not was_on:
            if "goal_position" not in written:  # it holds where it stands
                self._measure()
                self.table["goal_position"] = self.table["present_position"]
            self.torque_since = self._now if self.torque_since is None else self.torque_since
        self._drive()

    def _drive(self) -> None:
        table = self.table
        if not self.torque:
            self.axis.command(Drive())
            return
        unit = (1 if table["phase"] & FINE_SPEED_BIT else COARSE) * COUNT_RAD
        acceleration = table["acceleration"] * ACCELERATION_UNIT or math.inf
        # a bridge that is limited to a share of the supply drives no more than that share's current
        motor = self.axis.file.motor
        most = 1e-3 * table["torque_limit"] * motor.supply / motor.resistance
        if table["operating_mode"] == SPEED:
            goal = table["goal_speed"] * unit
            self.axis.command(Drive(plant.VELOCITY_MODE, goal, current_limit=most, acceleration=acceleration))
            return
        low, high = table["min_position_limit"], table["max_position_limit"]
        goal = (min(max(table["goal_position"], low), high) - CENTRE) * COUNT_RAD
        speed = abs(table["goal_speed"]) * unit or math.inf
        self.axis.command(Drive(plant.POSITION_MODE, goal, speed, most, acceleration))

    def _measure(self) -> None:
        table, reading = self.table, self.axis.read()
        table["present_load"] = round(1000.0 * reading.duty)
        table["present_voltage"] = round(10.0 * reading.voltage)
        table["present_current"] = round(reading.bus_current / CURRENT_UNIT)
        table["present_temperature"] = min(max(round(reading.temperature), 0), 255)
        unit = 1 if table["phase"] & FINE_SPEED_BIT else COARSE
        speed = 0 if self.stuck else round(reading.velocity / (COARSE * COUNT_RAD)) * COARSE // unit
        table["present_speed"] = speed
        table["moving"] = int(speed != 0)
        if not self.stuck:
            table["present_position"] = max(0, CENTRE + round(reading.position / COUNT_RAD))
