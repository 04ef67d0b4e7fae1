"""What one log contradicts itself in, named by its columns and places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.log import Log, columns_of, wiring
from idtool.log.columns import Columns
from idtool.log.effort import Effort

#: What loads the axis, by how much it may change from row to row while the axis moves, and why.
_TILTED = (0.1, "no frame is tilted that far from one row to the next")
_LOADS = {
    "payload": (0.0, "nobody hangs a weight on a moving axis"),
    "tilt_alpha": _TILTED,
    "tilt_beta": _TILTED,
}


def contradictions_of(
    log: Log, columns: Columns, first: NDArray[np.bool_], effort: Effort
) -> tuple[str, ...]:
    """Sentences on columns that contradict each other.

    Args:
        log: where the columns are from.
        columns: without readings that cannot be.
        first: True at the first row of each trial, shape (rows,).
        effort: where their effort is from.
    """
    names = columns_of(log.axis.kind)
    told = {
        names[role]: (values, role != "position_command")
        for role in ("velocity", "velocity_command", "position_command")
        if (values := log.column(role)) is not None
    }
    said = wiring.contradictions(
        columns.time,
        first,
        columns.position,
        columns.velocity,
        np.where(effort.untold, np.nan, columns.effort),
        effort.column,
        log.column("current"),
        told,
        log.axis.torque_constant,
        log.column("supply_voltage"),
    )
    measured = effort.column != names["duty"]  # a voltage is mostly back-EMF
    at = columns.position
    if measured and at is not None and wiring.adds_up(columns.time, first, at, columns.effort):
        said.append(
            f'"{effort.column}" is how fast the axis moves, times a number: it is a speed and no torque; are '
            "two columns swapped?"
        )
    for role, (least, why) in _LOADS.items():
        load = getattr(columns, role)
        if load is None or columns.position is None:
            continue
        rows = wiring.changed_in_motion(load, columns.position, columns.time, first, least)
        if len(rows):
            said.append(
                f"another {role.split('_')[0]} is told while the axis moves, first on "
                f"{log.place(int(rows[0]))} ({len(rows)} such): {why}"
            )
    return tuple(f"{log.source}: {sentence}." for sentence in said)
