"""The zero-phase low-pass that both sides of a fit go through: how wide it must be, and its matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array, Motion
from idtool.signals.smoother import reading_variance
from idtool.signals.sparse_rows import SparseRows

#: The filter lets pass up to this multiple of the highest frequency at which torque stands out of noise.
_BANDWIDTH_MARGIN = 1.5
_LEAST_BANDWIDTH_HZ = 10.0
#: What lies above it and adds up to less than this share of the torque (root mean square) is not worth
#: following: a recording that was filtered or resampled before has no floor of noise that would say so.
_NEGLIGIBLE = 0.01
#: Logs of rates closer than this share are of one rate; the filter is designed for no less than this share
#: of the median rate.
_SAME_RATE = 0.95
_LEAST_RATE = 0.2
#: Of a filtered row's weights at least this share must fall on usable rows.
_LEAST_WEIGHT = 0.6


@dataclass(frozen=True)
class Filter:
    """The zero-phase low-pass that both sides of the fit go through.

    Attributes:
        bandwidth_hz: frequency at which it halves the amplitude.
        rate_hz: rate of the rows that it leaves.
        taps: length of its Hann window in samples; 1 is no filter.
    """

    bandwidth_hz: float
    rate_hz: float
    taps: int


def common_rate(motion: Motion, source: NDArray[np.intp]) -> float:
    """The rate that the filter is designed for, Hz: that of the slowest log.

    At the median rate the rows of a slow log would be blurred over as many rows as those of the fast ones,
    which is for longer. Not below a share of the median: one coarse log must not undo the filter of all.
    """
    inside = ~motion.first
    median = 1.0 / motion.period
    logs = np.unique(source[inside])
    slowest = min(1.0 / float(np.median(motion.step[inside & (source == log)])) for log in logs)
    return median if slowest > _SAME_RATE * median else max(slowest, _LEAST_RATE * median)


def bandwidth_and_noise(torque: Array, motion: Motion, rate: float) -> tuple[float, float]:
    """The frequency up to which torque stands out of its noise, and the noise's standard deviation."""
    longest = int(np.max(motion.ends - motion.starts))
    segment = int(min(max(64, 2 ** int(np.log2(max(longest // 4, 8)))), 1024, longest))
    total, weight = None, 0
    for start, end in zip(motion.starts, motion.ends, strict=True):
        if end - start < segment:
            continue
        frequency, pieces = power_densities(torque[start:end], rate, segment)
        power = pieces.mean(axis=0)
        total = power * (end - start) if total is None else total + power * (end - start)
        weight += end - start
    if total is None:
        return 0.25 * rate, float(np.sqrt(reading_variance(torque, motion.first)))
    power = total / weight
    top = power[frequency > 0.66 * frequency[-1]]
    floor = float(np.median(top))
    above = np.flatnonzero(power > 3.0 * floor)
    edge = float(frequency[above[-1]]) if len(above) else 0.0
    # isolated lines far above the rest are hum, not motion: the edge is where the run from 0 ends
    gaps = np.flatnonzero(np.diff(above) > max(2, len(power) // 50)) if len(above) else np.array([])
    if len(gaps):
        edge = float(frequency[above[gaps[0]]])
    above_floor = np.maximum(power - floor, 0.0) * (frequency[1] - frequency[0])
    beyond = np.cumsum(above_floor[::-1])[::-1]
    worth = np.flatnonzero(beyond > _NEGLIGIBLE**2 * float(np.mean(torque**2)))
    edge = min(edge, float(frequency[worth[-1]]) if len(worth) else 0.0)
    bandwidth = float(np.clip(_BANDWIDTH_MARGIN * edge, _LEAST_BANDWIDTH_HZ, 0.5 * rate))
    return bandwidth, float(np.sqrt(floor * rate / 2.0))


def power_densities(values: Array, rate: float, segment: int) -> tuple[Array, Array]:
    """Frequencies and the one-sided power density of each piece, shape (pieces, frequencies), of which
    Welch's method takes the mean: Hann windows that overlap by half, the straight line taken off each (IEEE
    Trans. Audio Electroacoust. 15, 1967). As scipy.signal.welch, whose import takes longer than a fit."""
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(segment) / segment)
    pieces = np.lib.stride_tricks.sliding_window_view(values, segment)[:: segment - segment // 2]
    t = np.arange(segment) - 0.5 * (segment - 1)
    pieces = pieces - pieces.mean(axis=1, keepdims=True) - np.outer(pieces @ t / (t @ t), t)
    power = np.abs(np.fft.rfft(pieces * window)) ** 2 / (rate * float(window @ window))
    power[:, 1 : -1 if segment % 2 == 0 else None] *= 2.0
    return np.asarray(np.fft.rfftfreq(segment, 1.0 / rate), dtype=float), np.asarray(power)


def design(bandwidth: float, rate: float) -> Filter:
    """A Hann window halves the amplitude at rate / (its half length): two rows per such half length."""
    half = max(int(rate / bandwidth), 1)
    decimation = max(half // 2, 1)
    return Filter(rate / half, rate / decimation, 2 * half - 1)


def window(chosen: Filter) -> Array:
    """Weights of the rows around one, shape (taps,)."""
    return np.asarray(np.hanning(chosen.taps + 2)[1:-1])


def operator(motion: Motion, usable: NDArray[np.bool_], chosen: Filter) -> SparseRows:
    """Filter and decimation as one matrix, shape (filtered rows, rows); no row is blurred across stretches.

    Rows that have too few usable rows around them are left out.
    """
    half = (chosen.taps + 1) // 2
    decimation = max(half // 2, 1)
    offsets = np.arange(-half + 1, half)
    weights = window(chosen)
    centres = np.concatenate(
        [np.arange(start, end, decimation) for start, end in zip(motion.starts, motion.ends, strict=True)]
    )
    columns = centres[:, None] + offsets[None, :]
    inside = (columns >= 0) & (columns < len(motion))
    columns = np.clip(columns, 0, len(motion) - 1)
    inside &= motion.stretch[columns] == motion.stretch[centres][:, None]
    inside &= usable[columns]
    values = np.where(inside, weights[None, :], 0.0)
    total = values.sum(axis=1)
    keep = total >= _LEAST_WEIGHT * weights.sum()
    values = values[keep] / total[keep, None]
    columns, present = columns[keep], inside[keep]
    counts = present.sum(axis=1)
    pointer = np.concatenate([[0], np.cumsum(counts)])
    return SparseRows.of(values[present], columns[present], pointer, len(motion))
