"""What a torque constant says of the motor that has it.

A motor that gives K for each ampere makes K w of its own at a speed w: N m/A is V s/rad (N/A is V s/m),
whatever the gear. What feeds it gives more than that; and where a voltage drives it, its back-EMF is a part
of the viscous coefficient in V s/rad, so that K is below that.
"""

from __future__ import annotations

#: Where low voltage ends (direct current, IEC 60364); no drive of an axis is fed with more.
MOST_SUPPLY_V = 1500.0
#: Where extra-low voltage ends, V (direct current, IEC 61140), with which most servos of a bench are fed.
EXTRA_LOW_V = 60.0
#: The largest drive of an industrial robot's axis gives 64 A at its peak (KUKA KSD1-64, robots of 500 kg).
MOST_CURRENT_A = 64.0
#: An ampere may be of one phase, its rms or its peak, and friction of the gears takes a part of K.
_COUNTED = 3.0


def highest_back_emf(supply: float | None) -> float:
    """V that no motor makes of its own, fed with `supply` (V; None where nobody logged it)."""
    return MOST_SUPPLY_V if supply is None else _COUNTED * supply
