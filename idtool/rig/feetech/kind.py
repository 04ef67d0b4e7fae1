"""Feetech as a kind of servo for the rig."""

from __future__ import annotations

from idtool.rig.bus.rig import ServoKind
from idtool.rig.feetech.bus import Bus
from idtool.rig.feetech.servo import FeetechServo

FEETECH = ServoKind(baud=1_000_000, open_bus=Bus, servo=FeetechServo)
