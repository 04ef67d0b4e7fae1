"""Which rows are held out: they see neither the parameters nor the choice of effects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.signals import Recording

#: Every so many trials of an experiment one is held out.
_EVERY = 4
#: In a recording with fewer trials blocks of time stand in for trials, and where those to hold out have more
#: than this share of the rows: what is left may not show what the axis does.
_LEAST_TRIALS = 4
_MOST_HELD = 1 / 3
_BLOCKS = 16


@dataclass(frozen=True)
class Split:
    """A recording and its held-out rows.

    Attributes:
        recording: all rows; its `fold` numbers the trials, or the blocks of time that stand in for them.
        held_out: the folds that are held out.
        blocks: contiguous blocks of time stand in for trials. The motion runs on through those that are held
            out, so that a block has no start of its own.
    """

    recording: Recording
    held_out: tuple[int, ...]
    blocks: bool

    @cached_property
    def held(self) -> NDArray[np.bool_]:
        """Mask of the held-out rows, shape (rows,)."""
        fold = self.recording.motion.trial if self.recording.fold is None else self.recording.fold
        return np.isin(fold, self.held_out)

    @cached_property
    def training(self) -> Recording:
        """What fits and selection see."""
        if self.blocks:
            return self.recording.without_rows(self.held)
        kept = [t for t in range(self.recording.trials) if t not in self.held_out]
        return self.recording.subset(kept)


def split(recording: Recording) -> Split:
    """Choose held-out trials, or blocks of time where there are too few trials.

    Within each experiment every fourth trial is held out, never its first or its last one: those are
    mostly the extremes of payload, speed or frequency, and a model should not be judged on what it was
    never shown the like of.
    """
    if recording.trials >= _LEAST_TRIALS:
        held_out = _interior(recording)
        if held_out and np.isin(recording.filtered_trial, held_out).mean() <= _MOST_HELD:
            return Split(recording, held_out, False)
    fold, rows = _blocks(recording)
    compared = np.unique(fold[recording.row])  # a short one may have no filtered row
    held_out = tuple(compared[2::_EVERY].tolist())
    if not held_out or fold[-1] + 1 < _LEAST_TRIALS:
        raise InputError(
            f"{np.count_nonzero(recording.usable)} rows in motion are too few to hold any out",
            file=recording.sources[0],
            remedy=f"record {_LEAST_TRIALS * rows} such rows at least, or fit without looking for "
            "effects (`ffc-id fit-motion`)",
        )
    return Split(replace(recording, fold=fold), held_out, True)


def _interior(recording: Recording) -> tuple[int, ...]:
    names = np.array(recording.experiment)
    logs = np.array(recording.source)
    compared = np.isin(np.arange(recording.trials), recording.filtered_trial)
    held_out: list[int] = []
    for log in np.unique(logs):
        for name in np.unique(names[logs == log]):
            trials = np.flatnonzero((names == name) & (logs == log) & compared)
            held_out += [int(t) for k, t in enumerate(trials[:-1]) if k % _EVERY == 2]
    return tuple(sorted(held_out))


def _blocks(recording: Recording) -> tuple[NDArray[np.intp], int]:
    """Number of the block of time of each row, none of two trials, and how many rows to compare are one."""
    motion = recording.motion
    # a block must be long against the filter, and there must be enough of them to hold one out
    per_block = max(int(recording.usable.sum()) // _BLOCKS, 4 * recording.filter.taps)
    compared = np.cumsum(recording.usable)
    fold = np.empty(len(motion), dtype=np.intp)
    offset = 0
    for begin, end in zip(motion.starts, np.append(motion.starts[1:], len(motion)), strict=True):
        inside = compared[begin:end] - compared[begin]
        count = max(int(inside[-1] + 1) // per_block, 1)
        fold[begin:end] = offset + np.minimum(inside * count // max(int(inside[-1]) + 1, 1), count - 1)
        offset += count
    return fold, per_block
