"""Tables of DYNAMIXEL control items, such as the graph of DYNAMIXEL Wizard 2.0 saves them.

Wizard names a column after the item of the control table ("Present Position") and writes what the servo
answers: whole counts. ROBOTIS publishes no description of that file, so the columns are known by the
names of the items (https://emanual.robotis.com, control tables), whatever stands before or after them
("[ID:001] Present Position"), and the units are those of most servos of the X series. They are presumed,
never taken for granted: a P series servo, for one, counts 0.01 rpm and 1 mA.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pandas as pd

from idtool.importing.names import Meaning

#: item of the control table -> role, unit of a count on most servos of the X series, bits of the item
_ITEMS: dict[str, tuple[str, str, int]] = {
    "Present Position": ("position", "count:4096", 32),
    "Goal Position": ("position", "count:4096", 32),
    "Present Velocity": ("velocity", "0.229rpm", 32),
    "Goal Velocity": ("velocity", "0.229rpm", 32),
    "Present Current": ("current", "2.69mA", 16),
    "Goal Current": ("current", "2.69mA", 16),
    "Present PWM": ("duty", "count:885", 16),
    "Present Input Voltage": ("supply_voltage", "0.1V", 16),
    "Present Temperature": ("temperature", "degC", 8),
}
_MOTION = ("position", "velocity", "current", "duty")
_ITEM = re.compile(rf"\b({'|'.join(_ITEMS)})\b")


def item_of(name: str) -> str | None:
    """The item of the control table that a column is named after, or None.

    >>> item_of("[ID:001] Present Position(132)"), item_of("present_position")
    ('Present Position', None)
    """
    found = _ITEM.search(name)
    return found[1] if found else None


def interpret(frame: pd.DataFrame, notes: list[str]) -> tuple[dict[str, Meaning], dict[str, str]]:
    """What the columns mean, and the units presumed where they hold counts.

    Counts that lost their sign get it back, in place. A table with a fraction in a position, a velocity
    or a current was converted already: no unit is presumed for it.
    """
    if not frame.columns.is_unique:
        return {}, {}  # refused further on
    items = {str(name): item for name in frame.columns if (item := item_of(str(name)))}
    meanings = {
        name: Meaning(name, _ITEMS[item][0], commanded=item.startswith("Goal"))
        for name, item in items.items()
    }
    motion = [name for name, item in items.items() if _ITEMS[item][0] in _MOTION]
    if not motion or not all(_whole(frame[name]) for name in motion):
        return meanings, {}
    for name in motion:
        bits = _ITEMS[items[name]][2]
        if (signed := _signed(frame[name], bits)) is not None:
            frame[name] = signed
            notes.append(f'column "{name}" lost its sign: {1 << (bits - 1)} and above were taken as negative')
    notes.append(
        "taken for counts of a DYNAMIXEL X servo; compare the units with its control table (the current of "
        "an XL330 or XC330 is the supply's, in mA: --map bus_current_a=COLUMN --unit bus_current=mA)"
    )
    return meanings, {name: _ITEMS[item][1] for name, item in items.items() if _whole(frame[name])}


def _whole(column: pd.Series[Any]) -> bool:
    if not pd.api.types.is_numeric_dtype(column) or pd.api.types.is_bool_dtype(column):
        return False
    values = column.to_numpy(dtype=float, na_value=np.nan)
    values = values[np.isfinite(values)]
    return bool(len(values)) and bool((values == np.round(values)).all())


def _signed(column: pd.Series[Any], bits: int) -> pd.Series[Any] | None:
    """Two's complement undone, or None where no value needs it."""
    half = 1 << (bits - 1)
    above = column >= half
    if not above.any() or (column < 0).any() or (column >= 2 * half).any():
        return None
    return column.where(~above, column - 2 * half)
