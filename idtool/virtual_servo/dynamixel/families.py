"""What differs between the servos that share this control table: register 126 and its unit.

Source: ROBOTIS e-Manual, "Control Table" of each model ("Present Current" or "Present Load"); whose current
it is, see `idtool.rig.dynamixel.models`, from which nothing here is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Family:
    """Servos alike.

    Attributes:
        senses: the current of the motor, that of the supply, or a load.
        current_unit: of register 126, A, or a share of full load.
    """

    senses: Literal["motor", "supply", "load"]
    current_unit: float


_X = Family("motor", 2.69e-3)
_MX = Family("motor", 3.36e-3)
_SMALL = Family("supply", 1e-3)
_LOAD = Family("load", 1e-3)

#: By model number.
FAMILIES: dict[int, Family] = {
    **dict.fromkeys((30, 350, 1060, 1070, 1080), _LOAD),
    **dict.fromkeys((311, 321), _MX),
    **dict.fromkeys((1001, 1011, 1020, 1030, 1100, 1101, 1110, 1111, 1120, 1130, 1140, 1150, 1170, 1180), _X),
    **dict.fromkeys((1190, 1200, 1210, 1220, 1230, 1240), _SMALL),
}
