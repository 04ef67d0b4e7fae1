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
    from scipy import signal  # half a second of imports that a recording of few rows does not pay

    length = 2 * every + 1
    torque = recording.torque.copy()
    kept = []
    for begin, end in zip(motion.starts, motion.ends, strict=True):
        if end - begin > length:
            torque[begin:end] = signal.savgol_filter(torque[begin:end], length, 3)
        kept.append(np.arange(begin, end, every))
    rows = np.concatenate(kept)
    thinned = motion.part(rows)
    if motion.restart is not None:  # at the first row that is left of it
        left = np.searchsorted(rows, np.flatnonzero(motion.restart))
        thinned = replace(thinned, restart=np.isin(np.arange(len(rows)), left))
    chosen = lowpass.design(recording.filter.bandwidth_hz, rate / every)
    # neighbours share rows of the average: their noise is told as white noise that passes the filter as much
    shared = _overlap(signal.savgol_coeffs(length, 3))[::every]
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
        noise=recording.noise * float(np.sqrt(variance)),
        filter=chosen,
    )


def _overlap(weights: Array) -> Array:
    """Products of weights with themselves, shifted by 0, 1, ... rows."""
    return np.correlate(weights, weights, "full")[len(weights) - 1 :]
