"""By how much a speed reading is later than the position: servos filter the speed that they report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from idtool.log import Log, columns_of
from idtool.model.motion import Array

#: Lateness up to which to look, s, and by how many samples a speed may differ without being late.
_LONGEST, _SAMPLES = 0.08, 1.5
#: Over so many samples each way the position's slope is taken.
_REACH = 3


def velocity_lateness(time: Array, position: Array, velocity: Array) -> float:
    """By how much the speed of one trial is later than the position's slope, s; 0 below the sampling.

    Args:
        time: s, rising, shape (rows,).
        position, velocity: readings, shape (rows,).
    """
    period = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    inside = (time > time[0] + _LONGEST) & (time < time[-1] - _LONGEST)
    if inside.sum() < 20 or not np.ptp(velocity[inside]) > 0.0:
        return 0.0
    reach = _REACH * period
    slope = np.interp(time + reach, time, position) - np.interp(time - reach, time, position)
    slope /= 2.0 * reach
    tried = np.arange(0.0, _LONGEST, max(0.5 * period, 5e-4))
    spread = [float(np.std(np.interp(time + late, time, velocity)[inside] - slope[inside])) for late in tried]
    late = float(tried[int(np.argmin(spread))])
    return late if late > _SAMPLES * period else 0.0


def without_late_velocity(logs: Sequence[Log]) -> tuple[list[Log], list[str]]:
    """The logs without a speed column that is later than the position beside it, and a note on them."""
    kept, late = [], []
    for log in logs:
        one = _lateness_of(log)
        if one > 0.0:
            late.append(1e3 * one)
            log = replace(log, rows=log.frame.drop(columns=columns_of(log.axis.kind)["velocity"]))
        kept.append(log)
    if not late:
        return kept, []
    low, high = f"{min(late):.0f}", f"{max(late):.0f}"
    name = columns_of(logs[0].axis.kind)["velocity"]
    many = f"in {len(late)} of {len(logs)} logs {name}" if len(logs) > 1 else name
    note = (
        f"{many} is {low if low == high else f'{low} to {high}'} ms later than the position, whose slope was "
        "taken in its place."
    )
    return kept, [note]


def _lateness_of(log: Log) -> float:
    """Of the speed of a log, s: the median over its trials."""
    time, position, velocity = (log.column(role) for role in ("time", "position", "velocity"))
    if time is None or position is None or velocity is None:
        return 0.0
    trial = log.trial_of_rows
    each = [
        velocity_lateness(time[rows], position[rows], velocity[rows])
        for number in np.unique(trial)
        for rows in [trial == number]
    ]
    return float(np.median(each))
