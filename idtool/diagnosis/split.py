"""Which trials are held out: they see neither the parameters nor the choice of effects."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.signals import Recording

#: Every so many trials of an experiment one is held out.
_EVERY = 4
#: A recording with fewer trials is cut into blocks of time that stand in for trials.
_LEAST_TRIALS = 4
_BLOCKS = 16


@dataclass(frozen=True)
class Split:
    """A recording and its held-out trials.

    Attributes:
        recording: all trials (or the blocks that stand in for them).
        held_out: indices of the held-out trials.
        blocks: contiguous blocks of time stand in for trials.
    """

    recording: Recording
    held_out: tuple[int, ...]
    blocks: bool

    @property
    def training(self) -> tuple[int, ...]:
        """Indices of the other trials."""
        return tuple(t for t in range(self.recording.trials) if t not in self.held_out)


def split(recording: Recording) -> Split:
    """Choose held-out trials, or blocks of time where there are too few trials.

    Within each experiment every fourth trial is held out, never its first or its last one: those are
    mostly the extremes of payload, speed or frequency, and a model should not be judged on what it was
    never shown the like of.
    """
    if recording.trials >= _LEAST_TRIALS:
        held_out = _interior(recording)
        if held_out:
            return Split(recording, held_out, False)
    cut = cut_into_blocks(recording)
    held_out = tuple(t for t in range(cut.trials) if t % _EVERY == 2)
    return Split(cut, held_out, True)


def _interior(recording: Recording) -> tuple[int, ...]:
    names = np.array(recording.experiment)
    logs = np.array(recording.source)
    held_out: list[int] = []
    for log in np.unique(logs):
        for name in np.unique(names[logs == log]):
            trials = np.flatnonzero((names == name) & (logs == log))
            held_out += [int(t) for k, t in enumerate(trials[:-1]) if k % _EVERY == 2]
    return tuple(sorted(held_out))


def cut_into_blocks(recording: Recording) -> Recording:
    """The same rows with every trial cut into blocks of equal length, each with its own start."""
    motion = recording.motion
    lengths = np.diff(np.append(motion.starts, len(motion)))
    # a block must be long against the filter, and there must be enough of them to hold one out
    per_block = max(len(motion) // _BLOCKS, 4 * recording.filter.taps)
    counts = np.maximum(lengths // per_block, 1)
    if counts.sum() < _LEAST_TRIALS:
        raise InputError(
            f"{len(motion)} rows are too few to hold any out for a diagnosis",
            file=recording.sources[0],
            remedy=f"record {_LEAST_TRIALS * per_block} rows at least",
        )
    label: NDArray[np.intp] = np.empty(len(motion), dtype=np.intp)
    experiment: list[str] = []
    source: list[int] = []
    offset = 0
    for trial, (start, length, count) in enumerate(zip(motion.starts, lengths, counts, strict=True)):
        label[start : start + length] = offset + (np.arange(length) * count) // length
        experiment += [recording.experiment[trial]] * int(count)
        source += [recording.source[trial]] * int(count)
        offset += int(count)
    return replace(
        recording, motion=replace(motion, trial=label), experiment=tuple(experiment), source=tuple(source)
    )
