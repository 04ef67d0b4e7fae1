"""What is wrong with the readings of a log, repaired where that is safe, left out or refused where not."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of, sensor_faults
from idtool.model.motion import Array

#: Reasons for which rows are not compared, as they are told.
SATURATED = "current saturated"
STUCK = {"position": "position stuck", "velocity": "velocity stuck"}
#: A trial with more of its rows stuck than this is left out whole; a log with more of them is refused.
_MOSTLY = 0.5
#: A step of time this many times the usual one is a gap (rows that jitter by 30 % stay below it).
GAP = 1.75


@dataclass(frozen=True)
class Repaired:
    """The columns of one log, and what was done to them.

    Attributes:
        columns: by role; position and velocity are NaN at rows where their sensor is stuck.
        faulty: reason -> rows not to be compared, shape (rows,).
        dropped: reason -> rows of whole trials that were left out.
        remarks: sentences for the reader.
    """

    columns: dict[str, Array | None]
    faulty: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


def repair(log: Log, columns: dict[str, Array | None], *, every_row: bool = False) -> Repaired:
    """Look for faults of the sensors of one log.

    Args:
        log: where the columns are from.
        columns: role -> values of shape (rows,), or None; "effort" is the torque and "trial" counts from 0.
        every_row: leave no trials out.

    Raises:
        InputError: a sensor is stuck on most of the rows.
    """
    columns = dict(columns)
    time, trial, effort = columns["time"], columns["trial"], columns["effort"]
    assert time is not None
    assert trial is not None
    assert effort is not None
    first = np.ones(len(time), dtype=bool)
    first[1:] = np.diff(trial) != 0
    remarks = _missing_rows(log, time, first)
    position = columns["position"]
    if position is not None and log.axis.kind == "rotary":
        columns["position"], wraps = sensor_faults.unwrap(position, first)
        if wraps:
            remarks.append(
                f"{log.source}: the position wraps {wraps} times by whole turns; it was made continuous."
            )
    faulty = {SATURATED: sensor_faults.clipped(effort)}
    position, velocity = columns["position"], columns["velocity"]
    dropped: dict[str, int] = {}
    if position is not None and velocity is not None:
        masks = dict(zip(STUCK, sensor_faults.stuck(time, position, velocity, first), strict=True))
        whole = np.zeros(len(time), dtype=bool)
        for (role, mask), reading in zip(masks.items(), (position, velocity), strict=True):
            if mask.any():
                _refuse_mostly_stuck(log, role, mask)
                if not every_row:
                    whole |= _whole_trials(role, mask, trial, dropped)
                columns[role] = np.where(mask, np.nan, reading)
                faulty[STUCK[role]] = mask
        if whole.all():
            raise InputError(
                "position or velocity is stuck in every trial", file=log.source, remedy="record again"
            )
        if whole.any():
            columns = {role: None if values is None else values[~whole] for role, values in columns.items()}
            columns["trial"] = np.unique(trial[~whole], return_inverse=True)[1].astype(float)
            faulty = {reason: mask[~whole] for reason, mask in faulty.items()}
            remarks += [
                f"{log.source}: {rows} rows of whole trials were left out ({reason})."
                for reason, rows in dropped.items()
            ]
    return Repaired(columns, faulty, dropped, tuple(remarks))


def _refuse_mostly_stuck(log: Log, role: str, mask: NDArray[np.bool_]) -> None:
    if np.mean(mask) <= _MOSTLY:
        return
    name = columns_of(log.axis.kind)[role]
    other = columns_of(log.axis.kind)["velocity" if role == "position" else "position"]
    raise InputError(
        f'column "{name}" stands still on {int(mask.sum())} of {len(mask)} rows while "{other}" moves on: '
        "the sensor is stuck",
        file=log.source,
        place=f"from row {int(np.argmax(mask)) + 1} of the data",
        remedy=f'remove column "{name}" or record again',
    )


def _whole_trials(
    role: str, mask: NDArray[np.bool_], trial: Array, dropped: dict[str, int]
) -> NDArray[np.bool_]:
    """Rows of the trials in which a sensor is mostly stuck; their number is added to `dropped`."""
    numbers = trial.astype(np.intp)
    whole = (np.bincount(numbers, mask) / np.bincount(numbers) > _MOSTLY)[numbers]
    if whole.any():
        dropped[STUCK[role]] = int(whole.sum())
    return whole


def _missing_rows(log: Log, time: Array, first: NDArray[np.bool_]) -> list[str]:
    missing = missing_rows(time, first)
    if not missing:
        return []
    share = 100.0 * missing / (missing + len(time))
    return [f"{log.source}: {missing} rows are missing (gaps in time, {share:.2g} % of the rows)."]


def missing_rows(time: Array, first: NDArray[np.bool_]) -> int:
    """How many rows the gaps in time of a log would have held.

    Args:
        time: s, shape (rows,).
        first: True at the first row of each trial.
    """
    steps = np.diff(time)[~first[1:]]
    if not len(steps):
        return 0
    ratio = steps / float(np.median(steps))
    return int(np.sum(np.round(ratio[ratio > GAP]) - 1))
