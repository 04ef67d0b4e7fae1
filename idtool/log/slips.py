"""A position that jumps for good, made continuous."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from idtool.log.clock import GAP
from idtool.model.motion import Array


def continuous(
    time: Array, first: NDArray[np.bool_], position: Array, slips: dict[int, float], wraps: bool
) -> tuple[Array, NDArray[np.bool_]]:
    """The position without its jumps, and rows whose place is not known all the same, shape (rows,) each.

    Args:
        time: s, shape (rows,).
        first: True at the first row of each trial.
        position: readings, shape (rows,).
        slips: rows of jumps, in their order, and by how much each.
        wraps: they are of a counter that wraps, which tells every place.
    """
    starts = np.append(np.flatnonzero(first), len(first))
    offset, unknown = np.zeros(len(first)), np.zeros(len(first), dtype=bool)
    period = float(np.median(np.diff(time)[~first[1:]]))
    for row, jump in slips.items():
        number = int(np.searchsorted(starts, row, side="right"))
        begin, end = int(starts[number - 1]), int(starts[number])
        offset[row:end] -= jump
        # where the axis was read moving on just before, its place after the jump is known as well
        known = row - begin >= 2 and position[row - 1] != position[row - 2]
        if not wraps and (not known or time[row] - time[row - 2] > (1.0 + GAP) * period):
            unknown[slice(begin, row) if row - begin < end - row else slice(row, end)] = True
    for begin, end in () if wraps else pairwise(starts.tolist()):
        # most of a trial stays where it was read: gravity depends on the place
        levels, rows = np.unique(offset[begin:end], return_counts=True)
        offset[begin:end] -= levels[np.argmax(rows)]
    return position + offset, unknown
