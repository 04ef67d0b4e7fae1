"""What is wrong with the readings of a log, repaired where that is safe, left out or refused where not."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of, impossible, sensor_faults, wiring
from idtool.log.effort import Effort
from idtool.log.impossible import GAP
from idtool.model.motion import Array

#: Reasons for which rows are not compared, as they are told.
SATURATED = "current saturated"
STUCK = {"position": "position stuck", "velocity": "velocity stuck"}
#: A trial with more of its rows stuck than this is left out whole; a log with more of them is refused.
_MOSTLY = 0.5
#: Reasons for which single readings are left out.
IMPOSSIBLE = {
    "position": "impossible position",
    "velocity": "impossible speed",
    "effort": "impossible torque",
}
_SLIPPED = "position slipped"
_MISDATED = "impossible time"
#: So many impossible readings of a column are told one by one; the rest are counted.
_TOLD = 3
#: Rows further apart than this, s, are no recording of a servo's friction: the clock counts something else.
_SLOWEST = 1.0
#: What loads the axis, by how much it may change from row to row while the axis moves, and why.
_TILTED = (0.1, "no frame is tilted that far from one row to the next")
_LOADS = {
    "payload": (0.0, "nobody hangs a weight on a moving axis"),
    "tilt_alpha": _TILTED,
    "tilt_beta": _TILTED,
}
#: Rows on either side of a gap that tell which way the axis went.
_BESIDE = 5
_FASTEST = 1e-6
#: Period of the fastest current loops of servo drives (40 kHz), s: what they measure comes no faster.
_CURRENT_LOOP_S = 2.5e-5
#: Rows of a trial in which noise can be told from motion: one third difference.
_SHORTEST = 4
#: Of a clock with so many pauses that all other steps together are a smaller share of the time than this, no
#: step is a time between measurements.
_PAUSES, _PAUSES_ONLY = 20, 0.1


@dataclass(frozen=True)
class Reading:
    """A reading that cannot be.

    Attributes:
        row: of the log's frame, from 0.
        column: in which it is.
        value: what was read.
        expected: what the rows around it say.
    """

    row: int
    column: str
    value: float
    expected: float


@dataclass(frozen=True)
class Repaired:
    """The columns of one log, and what was done to them.

    Attributes:
        columns: by role; position and velocity are NaN at rows where their sensor is stuck or what it read
            cannot be; a torque that cannot be is replaced by what the rows around it say.
        faulty: reason -> rows not to be compared, shape (rows,).
        dropped: reason -> rows of whole trials that were left out.
        remarks: sentences for the reader.
        impossible: the readings that cannot be, in the order of the rows.
        wiring: sentences on columns that contradict each other, to be read before any number.
    """

    columns: dict[str, Array | None]
    faulty: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    impossible: tuple[Reading, ...] = ()
    wiring: tuple[str, ...] = ()


def repair(
    log: Log, columns: dict[str, Array | None], effort_read: Effort, *, every_row: bool = False
) -> Repaired:
    """Look for faults of the sensors of one log.

    Args:
        log: where the columns are from.
        columns: role -> values of shape (rows,), or None; "effort" is the torque and "trial" counts from 0.
        effort_read: where that torque is from.
        every_row: leave no trials out.

    Raises:
        InputError: a sensor is stuck on most of the rows, the axis never moves, or the clock is none of a
            servo.
    """
    columns = dict(columns)
    time, trial = columns["time"], columns["trial"]
    assert time is not None
    assert trial is not None
    first = np.ones(len(time), dtype=bool)
    first[1:] = np.diff(trial) != 0
    _refuse_odd_clock(log, time, first)
    _refuse_dead_encoder(log, columns)
    remarks: list[str] = []
    readings: list[Reading] = []
    misdated = _set_clock(log, columns, first, remarks, readings)
    time = columns["time"]
    assert time is not None
    columns["trial"] = trial = _cut_at_gaps(log, columns, time, first, remarks)
    short = _too_short(log, trial)
    remarks += [*_missing_rows(log, time, first), *_doubtful_clock(log, time, first)]
    position = columns["position"]
    if position is not None and log.axis.kind == "rotary":
        columns["position"], wraps = sensor_faults.unwrap(position, first)
        if wraps:
            remarks.append(
                f"{log.source}: the position wraps {wraps} times by whole turns; it was made continuous."
            )
    faulty = misdated | _leave_out_impossible(log, columns, effort_read, time, first, remarks, readings)
    faulty |= effort_read.unfit
    blank = {
        role: faulty[reason] for role, reason in IMPOSSIBLE.items() if role in STUCK and reason in faulty
    }
    position, velocity, effort = columns["position"], columns["velocity"], columns["effort"]
    assert effort is not None
    names = columns_of(log.axis.kind)
    told = {
        names[role]: values
        for role in ("velocity", "velocity_command", "position_command")
        if (values := log.column(role)) is not None
    }
    contradictions = wiring.contradictions(
        time, first, position, velocity, effort, log.column("current"), told
    )
    contradictions += _load_in_motion(log, columns, time, first)
    faulty[SATURATED] = sensor_faults.clipped(effort)
    dropped: dict[str, int] = {}
    whole = np.zeros(len(time), dtype=bool)
    if short.any() and not every_row:
        whole, dropped[f"trial of fewer than {_SHORTEST} rows"] = short, int(short.sum())
    if position is not None and velocity is not None:
        masks = dict(zip(STUCK, sensor_faults.stuck(time, position, velocity, first), strict=True))
        for role, mask in masks.items():
            if mask.any():
                _refuse_mostly_stuck(log, role, mask)
                if not every_row:
                    whole |= _whole_trials(role, mask, trial, dropped)
                blank[role] = blank.get(role, np.zeros(len(time), dtype=bool)) | mask
                faulty[STUCK[role]] = mask
    for role, rows in blank.items():
        values = columns[role]
        assert values is not None
        columns[role] = np.where(rows & ~first, np.nan, values)  # a trial starts from a number
    if whole.all():
        raise InputError(
            "every trial is too short, or its position or velocity is stuck",
            file=log.source,
            remedy="record again",
        )
    if whole.any():
        columns = {role: None if values is None else values[~whole] for role, values in columns.items()}
        columns["trial"] = np.unique(trial[~whole], return_inverse=True)[1].astype(float)
        faulty = {reason: mask[~whole] for reason, mask in faulty.items()}
        remarks += [
            f"{log.source}: {rows} rows of whole trials were left out ({reason})."
            for reason, rows in dropped.items()
        ]
    said = tuple(f"{log.source}: {sentence}." for sentence in contradictions)
    readings.sort(key=lambda one: one.row)
    return Repaired(columns, faulty, dropped, tuple(remarks), tuple(readings), said)


def _load_in_motion(
    log: Log, columns: dict[str, Array | None], time: Array, first: NDArray[np.bool_]
) -> list[str]:
    position, said = columns["position"], []
    for role, (least, why) in _LOADS.items():
        told = columns[role]
        if told is None or position is None:
            continue
        rows = wiring.changed_in_motion(told, position, time, first, least)
        if len(rows):
            said.append(
                f"another {role.split('_')[0]} is told while the axis moves, first on "
                f"{log.place(int(rows[0]))} ({len(rows)} such): {why}"
            )
    return said


def _refuse_odd_clock(log: Log, time: Array, first: NDArray[np.bool_]) -> None:
    steps = np.diff(time)[~first[1:]]
    usual = float(np.median(steps)) if len(steps) else _FASTEST
    pauses = steps > GAP * usual
    if np.count_nonzero(pauses) > _PAUSES and steps[~pauses].sum() < _PAUSES_ONLY * steps.sum():
        raise InputError(
            f'column "time_s" comes in bursts ({usual:.3g} s from row to row, and {np.sum(pauses)} pauses of '
            f"{float(np.median(steps[pauses])):.3g} s), as packets arrive",
            file=log.source,
            remedy="record the time of each measurement, or give evenly spaced times if the rate was even",
        )
    if _FASTEST <= usual < _SLOWEST:
        return
    guess = "milli-, micro- or nanoseconds" if usual >= _SLOWEST else "hours or days"
    raise InputError(
        f'column "time_s" steps by {usual:.3g} s, no rate at which a servo is recorded',
        file=log.source,
        remedy=f"if it counts {guess}, say so: `ffc-id import --unit time=ms` (or us, ns)",
    )


def _doubtful_clock(log: Log, time: Array, first: NDArray[np.bool_]) -> list[str]:
    usual = float(np.median(np.diff(time)[~first[1:]]))
    if usual >= _CURRENT_LOOP_S:
        return []
    return [
        f"{log.source}: a row comes every {1e6 * usual:.3g} us, faster than the current loop of any drive: "
        "look whether time_s counts seconds, since speeds, inertia and viscous friction follow from it."
    ]


def _set_clock(
    log: Log,
    columns: dict[str, Array | None],
    first: NDArray[np.bool_],
    remarks: list[str],
    readings: list[Reading],
) -> dict[str, NDArray[np.bool_]]:
    """Put the clock of the rows around into `columns` where a time is none of a reading; reason -> rows."""
    time, position = columns["time"], columns["position"]
    assert time is not None
    if position is None:
        return {}
    rows, even = impossible.stamps(time, first, position)
    if not rows.any():
        return {}
    columns["time"] = even
    name = columns_of(log.axis.kind)["time"]
    readings += [Reading(int(k), name, float(time[k]), float(even[k])) for k in np.flatnonzero(rows)]
    worst = int(np.argmax(np.abs(time - even)))
    remarks.append(
        f"{log.source}, {log.place(worst)}: {name} is {1e3 * (time - even)[worst]:+.3g} ms off the clock "
        f"of the rows around it, and the axis was where that clock says ({int(rows.sum())} such); left out."
    )
    return {_MISDATED: rows}


def _refuse_dead_encoder(log: Log, columns: dict[str, Array | None]) -> None:
    names = columns_of(log.axis.kind)
    there = {role: values for role in STUCK if (values := columns[role]) is not None}
    still = [
        role
        for role, values in there.items()
        if np.ptp(values) == 0.0 and (role == "position" or values[0] == 0)
    ]
    if len(still) == len(there):
        listed = " and ".join(f'"{names[role]}"' for role in still)
        never = f"columns {listed} never change" if len(still) > 1 else f"column {listed} never changes"
        raise InputError(
            f"{never}: the axis was held, or its encoder is dead",
            file=log.source,
            remedy="check the encoder and its cable and record again, or leave this log out",
        )


def _cut_at_gaps(
    log: Log, columns: dict[str, Array | None], time: Array, first: NDArray[np.bool_], remarks: list[str]
) -> Array:
    """The trial of each row; `first` is marked where a gap begins a new one."""
    cuts = gap_cuts(time, first, columns["position"], columns["velocity"])
    if cuts.any():
        remarks.append(
            f"{log.source}: {int(cuts.sum())} gaps in time (the first before "
            f"{log.place(int(np.argmax(cuts)))}) hide a reversal, or are long enough for the axis to go all "
            "its way; a new trial begins after each."
        )
        first |= cuts
    return np.asarray(np.cumsum(first) - 1.0)


def gap_cuts(
    time: Array, first: NDArray[np.bool_], position: Array | None, velocity: Array | None
) -> NDArray[np.bool_]:
    """Rows before which so much time is missing that the axis could have gone all its way meanwhile, or has
    turned round.

    Nothing is known of the friction's state after such a gap: a trial begins there.

    Args:
        time: s, shape (rows,).
        first: True at the first row of each trial.
        position, velocity: readings, shape (rows,), or None.
    """
    steps = np.where(first[1:], 0.0, np.diff(time))
    cuts = np.zeros(len(time), dtype=bool)
    usual = float(np.median(steps[~first[1:]])) if (~first[1:]).any() else np.inf
    long = steps > GAP * usual
    if not long.any():
        return cuts
    inside = ~first[1:] & ~long
    if position is None:
        assert velocity is not None
        speed = np.abs(velocity)
        way = float(np.sum(speed[1:][inside] * steps[inside]))
    else:
        speed = np.abs(np.diff(position)[inside]) / steps[inside]
        way = float(np.ptp(position))
    # the usual speed of a move, which a few impossible readings do not change
    moving = speed[speed > 0.0]
    if len(moving):
        cuts[1:] = long & (steps * float(np.median(moving)) > way)
    if position is not None:
        step = float(np.median(np.abs(np.diff(position)[inside])))
        for row in np.flatnonzero(long) + 1:
            cuts[row] |= _turned(position, first, int(row), step)
    return cuts


def _turned(position: Array, first: NDArray[np.bool_], row: int, step: float) -> bool:
    """Whether the axis turned round in the gap before `row`, for certain: it goes the other way after it, or
    came back across it; `step` is the usual way of a row."""
    before, after = row - 1 - _BESIDE, row + _BESIDE
    if before < 0 or after >= len(position) or first[before + 1 : after + 1].any():
        return False
    ways = np.diff(position[[before, row - 1, row, after]])
    sign = np.where(np.abs(ways) > 0.5 * _BESIDE * step, np.sign(ways), 0.0)
    return bool(sign[0] * sign[2] < 0.0 or sign[0] * sign[1] < 0.0)


def _leave_out_impossible(
    log: Log,
    columns: dict[str, Array | None],
    effort_read: Effort,
    time: Array,
    first: NDArray[np.bool_],
    remarks: list[str],
    readings: list[Reading],
) -> dict[str, NDArray[np.bool_]]:
    """Put what the rows around say into `columns` where a reading cannot be; reason -> rows."""
    effort = columns["effort"]
    assert effort is not None
    found = impossible.find(time, first, columns["position"], columns["velocity"], effort)
    names = columns_of(log.axis.kind)
    names["effort"] = effort_read.column
    faulty: dict[str, NDArray[np.bool_]] = {}
    for role, reason in IMPOSSIBLE.items():
        rows = getattr(found, role)
        if not rows.any():
            continue
        faulty[reason] = rows
        raw = log.frame[names[role]].to_numpy(dtype=float)
        values = columns[role]
        assert values is not None
        said = found.expected[role] / (effort_read.scale if role == "effort" else 1.0)
        several = [Reading(int(k), names[role], float(raw[k]), float(said[k])) for k in np.flatnonzero(rows)]
        columns[role] = np.where(rows, found.expected[role], values)
        remarks += _tell(log, several)
        readings += several
    if found.slips:
        faulty[_SLIPPED] = _undo_slips(log, columns, first, found.slips, remarks)
    return faulty


def _tell(log: Log, several: list[Reading]) -> list[str]:
    sentences = [
        f"{log.source}, {log.place(one.row)}: {one.column} {one.value:.6g} cannot be (the rows around it say "
        f"{one.expected:.4g}); it was left out."
        for one in several[:_TOLD]
    ]
    if len(several) > _TOLD:
        more = len(several) - _TOLD
        sentences.append(
            f"{log.source}: {more} more of {several[0].column} cannot be, from "
            f"{log.place(several[_TOLD].row)} to {log.place(several[-1].row)}; they were left out."
        )
    return sentences


def _undo_slips(
    log: Log,
    columns: dict[str, Array | None],
    first: NDArray[np.bool_],
    slips: dict[int, float],
    remarks: list[str],
) -> NDArray[np.bool_]:
    """Make the position continuous where it jumps for good; rows whose place is not known then."""
    position = columns["position"]
    assert position is not None
    starts = np.append(np.flatnonzero(first), len(first))
    offset, unknown = np.zeros(len(first)), np.zeros(len(first), dtype=bool)
    for row, jump in slips.items():
        number = int(np.searchsorted(starts, row, side="right"))
        begin, end = int(starts[number - 1]), int(starts[number])
        offset[row:end] -= jump
        unknown[slice(begin, row) if row - begin < end - row else slice(row, end)] = True
    columns["position"] = position + offset
    sizes = np.abs(list(slips.values()))
    name = columns_of(log.axis.kind)["position"]
    row = next(iter(slips))
    if impossible.alike(sizes):
        remarks.append(
            f"{log.source}: {name} wraps {len(slips)} times by {float(np.median(sizes)):.3g}; "
            "it was made continuous."
        )
        return np.zeros(len(first), dtype=bool)
    remarks.append(
        f"{log.source}, {log.place(row)}: {name} jumps by {slips[row]:.4g}, which no motion of this log "
        f"comes near, and stays there ({len(slips)} such); {int(unknown.sum())} rows on the shorter side "
        "were left out."
    )
    return unknown


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


def _too_short(log: Log, trial: Array) -> NDArray[np.bool_]:
    """Rows of the trials that are too short to tell a motion from noise."""
    numbers = trial.astype(np.intp)
    rows = np.bincount(numbers)
    if np.max(rows) < _SHORTEST:
        raise InputError(
            f"none of its {len(rows)} trials has {_SHORTEST} rows, as a motion needs to be told from noise",
            file=log.source,
            remedy='a trial is one run of the axis: look at column "trial", and whether the clock rises',
        )
    return np.asarray((rows < _SHORTEST)[numbers])


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
    are = "row is" if missing == 1 else "rows are"
    return [f"{log.source}: {missing} {are} missing (gaps in time, {share:.2g} % of the rows)."]


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
