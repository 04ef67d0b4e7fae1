"""Readings that stayed as they were while the axis went on: a bus that answered nothing new for some rows.

A position that repeats itself while the axis moves on before and after it, and then is at once where that
motion would have brought it, was not read in between. No bound of time is needed: how likely so many
repetitions are follows from how often a reading of this log is repeated while the axis moves.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from idtool.log.sensor_faults import resolution
from idtool.model.motion import Array

#: Steps on either side whose median says how fast the axis goes.
_BESIDE = 7
#: An axis moves that goes so many steps of its sensor from row to row: no reading is repeated by rounding.
_MOVES = 2.0
#: What it goes at once afterwards, as a share of what it would have gone at the slower and the faster speed.
_CAUGHT_UP = (0.5, 2.0)
#: After as many repetitions as elsewhere in a log, one step of so many times those on both sides.
_JUMPS = 2.0
#: Chance that a recording holds as many repetitions in a row.
_CHANCE = 1e-6


def stale(first: NDArray[np.bool_], position: Array) -> NDArray[np.bool_]:
    """Rows whose position was not read anew though the axis went on, shape (rows,).

    Args:
        first: True at the first row of each trial.
        position: readings, shape (rows,).
    """
    rows = np.zeros(len(position), dtype=bool)
    ways = np.where(first[1:], np.nan, np.diff(position))
    grain = resolution(position)
    begins, ends = _still(ways)
    if not len(begins) or grain == 0.0:
        return rows
    moving = int(np.count_nonzero(np.abs(ways) > _MOVES * grain))
    jumps = np.zeros(len(begins), dtype=bool)
    for number, (begin, end) in enumerate(zip(begins.tolist(), ends.tolist(), strict=True)):
        before, after = ways[max(begin - _BESIDE, 0) : begin], ways[end + 1 : end + 1 + _BESIDE]
        if len(before) < _BESIDE or len(after) < _BESIDE:
            continue
        speeds = np.sort([np.median(before), np.median(after)])  # NaN beside the end of a trial
        jumps[number] = abs(ways[end]) > _JUMPS * max(np.abs(speeds).max(), _MOVES * grain)
        slow, fast = (speeds if speeds[0] > 0.0 else -speeds[::-1]) * (end - begin + 1)
        caught_up = ways[end] if speeds[0] > 0.0 else -ways[end]
        moves = slow > _MOVES * grain * (end - begin + 1)
        if moves and _CAUGHT_UP[0] * slow < caught_up < _CAUGHT_UP[1] * fast:
            rows[begin + 1 : end + 1] = True
    found = int(np.count_nonzero(rows))
    again = found / max(found + moving, 1)
    certain = 0
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        if rows[end] and (end - begin) * math.log(again) + math.log(len(rows)) > math.log(_CHANCE):
            rows[begin + 1 : end + 1] = False
        elif rows[end]:
            certain = min(certain or end - begin, end - begin)
    if certain:  # a bus that did so mid-way does so beside a reversal too, where it is not as plain
        for begin, end in zip(begins[jumps].tolist(), ends[jumps].tolist(), strict=True):
            rows[begin + 1 : end + 1] |= end - begin >= certain
    return rows


def frozen(first: NDArray[np.bool_], position: Array, effort: Array) -> NDArray[np.bool_]:
    """Rows whose effort was not read anew while the axis moved, shape (rows,): one that repeats itself to the
    last digit for longer than chance, as often as readings of this log repeat themselves elsewhere.

    An effort of nothing is none that was not read, for a drive may be off; nor is one at an end of its range.

    Args:
        first: True at the first row of each trial.
        position, effort: readings, shape (rows,); NaN is none.
    """
    rows = np.zeros(len(effort), dtype=bool)
    steps = np.where(first[1:], np.nan, np.diff(effort))
    begins, ends = _still(steps)
    if not len(begins):
        return rows
    lengths, values = ends - begins, effort[begins]
    moves = np.concatenate([[0], np.cumsum(np.diff(position) != 0.0)])
    told = 2 * (moves[ends] - moves[begins]) > lengths
    told &= (values != 0.0) & (values != np.nanmax(effort)) & (values != np.nanmin(effort))
    while told.any():
        again = max(int(lengths[~told].sum()), 1) / max(len(effort) - int(lengths[told].sum()), 2)
        kept = told & (lengths * math.log(again) + math.log(len(rows)) < math.log(_CHANCE))
        if (kept == told).all():
            break
        told = kept
    for begin, end in zip(begins[told].tolist(), ends[told].tolist(), strict=True):
        rows[begin + 1 : end + 1] = True
    return rows


def _still(ways: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last but one step of each stretch of steps of nothing: [begin, end) are zero."""
    edges = np.diff(np.concatenate([[0], (ways == 0.0).astype(int), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    inside = ends < len(ways)
    return begins[inside], ends[inside]
