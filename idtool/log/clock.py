"""The clock of a log: whether it is one of a servo, and what its gaps hide."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log
from idtool.model.motion import Array

#: A step of time this many times the usual one is a gap (rows that jitter by 30 % stay below it).
GAP = 1.75
#: Rows further apart or closer than this, s, are no recording of a servo's friction: the clock counts
#: something else.
_SLOWEST, _FASTEST = 1.0, 1e-6
#: Period of the fastest current loops of servo drives (40 kHz), s: what they measure comes no faster.
_CURRENT_LOOP_S = 2.5e-5
#: Of a clock with so many pauses that all other steps together are a smaller share of the time than this, no
#: step is a time between measurements.
_PAUSES, _PAUSES_ONLY = 20, 0.1
#: Rows on either side of a gap that tell which way the axis went.
_BESIDE = 5


def refuse_odd_clock(log: Log, time: Array, first: NDArray[np.bool_]) -> None:
    """Refuse times that no servo was recorded at.

    Raises:
        InputError: they come in bursts, or count something else than seconds.
    """
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


def doubts(time: Array, first: NDArray[np.bool_]) -> list[str]:
    """Sentences on rows that are missing and a clock that is too fast, without the log's name."""
    said = []
    missing = missing_rows(time, first)
    if missing:
        share = 100.0 * missing / (missing + len(time))
        are = "row is" if missing == 1 else "rows are"
        said.append(f"{missing} {are} missing (gaps in time, {share:.2g} % of the rows).")
    usual = float(np.median(np.diff(time)[~first[1:]]))
    if usual < _CURRENT_LOOP_S:
        said.append(
            f"a row comes every {1e6 * usual:.3g} us, faster than the current loop of any drive: "
            "look whether time_s counts seconds, since speeds, inertia and viscous friction follow from it."
        )
    return said


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
