"""Fewer rows where a recording has more than its filter lets through.

A search over models evaluates every row some thousand times. Rows that lie much closer than the filter's
window tell it nothing; the torque between them is averaged by a local cubic, which bends none that passes
the filter (Savitzky & Golay, Anal. Chem. 36, 1964).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from idtool.model.motion import Array
from idtool.signals import lowpass
from idtool.signals.recording import Recording

#: Rows that are left for each period of the filter's bandwidth, two and a half times what Nyquist asks for.
_ROWS_PER_PERIOD = 5


def thin(recording: Recording) -> Recording:
    """The recording with as many rows as its filter needs; itself where it has no more."""
    motion = recording.motion
    rate = 1.0 / motion.period
    every = int(rate / (_ROWS_PER_PERIOD * recording.filter.bandwidth_hz))
    if every < 2:
        return recording
    length = 2 * every + 1
    cubic = _local_cubic(every)
    torque = recording.torque.copy()
    kept = []
    for begin, end in zip(motion.starts, motion.ends, strict=True):
        if end - begin > length:
            torque[begin:end] = _averaged(torque[begin:end], cubic)
        kept.append(np.arange(begin, end, every))
    rows = np.concatenate(kept)
    thinned = motion.part(rows)
    if motion.restart is not None:  # at the first row that is left of it
        left = np.searchsorted(rows, np.flatnonzero(motion.restart))
        thinned = replace(thinned, restart=np.isin(np.arange(len(rows)), left))
    chosen = lowpass.design(recording.filter.bandwidth_hz, rate / every)
    # neighbours share rows of the average: their noise is told as white noise that passes the filter as much
    shared = _overlap(cubic[every])[::every]
    window = _overlap(lowpass.window(chosen))
    passed = window[: len(shared)] * shared[: len(window)]
    variance = (2.0 * passed.sum() - passed[0]) / window[0]
    return replace(
        recording,
        motion=thinned,
        torque=torque[rows],
        usable=recording.usable[rows],
        at_rest=recording.at_rest[rows],
        fold=None if recording.fold is None else recording.fold[rows],
        weight=None if recording.weight is None else recording.weight[rows],
        unsure=None if recording.unsure is None else recording.unsure[rows],
        noise=recording.noise * float(np.sqrt(variance)),
        filter=chosen,
    )


def _local_cubic(half: int) -> Array:
    """The cubic through `2 half + 1` rows by least squares: a matrix from those rows to its values there."""
    powers = np.vander(np.linspace(-1.0, 1.0, 2 * half + 1), 4)
    return np.asarray(powers @ np.linalg.pinv(powers))


def _averaged(values: Array, cubic: Array) -> Array:
    """Each value by the cubic around it, at the ends by the last whole one; as scipy.signal.savgol_filter,
    whose import takes longer than a fit."""
    half, length = len(cubic) // 2, len(cubic)
    inside = np.convolve(values, cubic[half, ::-1], "valid")
    return np.concatenate([cubic[:half] @ values[:length], inside, cubic[half + 1 :] @ values[-length:]])


def _overlap(weights: Array) -> Array:
    """Products of weights with themselves, shifted by 0, 1, ... rows."""
    return np.correlate(weights, weights, "full")[len(weights) - 1 :]
