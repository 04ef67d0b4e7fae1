"""What the formula of an effect is told: one row of a motion, in floats, or all rows at once, in arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

from idtool.model.jit import jit

#: A float, or an array of one per row.
Number = Any


class Row(NamedTuple):
    """Quantities and units as in `Motion`; NaN stands for what is not known, but a tilt is 0 then. A memory
    starts anew where `first` is true, and there at `start` in its range, -1 to 1."""

    first: Number
    start: Number
    step: Number
    time: Number
    position: Number
    velocity: Number
    acceleration: Number
    payload: Number
    load: Number
    load_upright: Number
    tilt_alpha: Number
    tilt_beta: Number
    temperature: Number
    torque_constant: Number
    clock: Number


@jit()
def row_of(rows: Row, k: int) -> Row:
    """One of all rows."""
    return Row(
        rows.first[k],
        rows.start[k],
        rows.step[k],
        rows.time[k],
        rows.position[k],
        rows.velocity[k],
        rows.acceleration[k],
        rows.payload[k],
        rows.load[k],
        rows.load_upright[k],
        rows.tilt_alpha[k],
        rows.tilt_beta[k],
        rows.temperature[k],
        rows.torque_constant[k],
        rows.clock[k],
    )
