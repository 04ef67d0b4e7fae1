"""DYNAMIXEL as a kind of servo for the rig."""

from __future__ import annotations

from idtool.rig.bus.rig import ServoKind
from idtool.rig.dynamixel.bus import Bus
from idtool.rig.dynamixel.servo import DynamixelServo

DYNAMIXEL = ServoKind(baud=57600, open_bus=Bus, servo=DynamixelServo)
