"""The low-pass that a torque went through before it was logged.

A drive's noise is white: its spectrum is level up to the highest frequency that a log shows. Where it falls
there like a power of the frequency, the torque was smoothed before it was written: by the drive as it came,
or by somebody later on, forwards and backwards (filtfilt). The motion was not smoothed with it, so what a
model predicts from it must go through the same filter before the two are compared. Which filter is told by
how much of a prediction is in the log, frequency by frequency (`idtool.fit.own_filter`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array, Motion
from idtool.signals.lowpass import power_densities
from idtool.signals.sparse_rows import SparseRows

#: Rows of a piece of the spectrum, and the fewest of them whose median is steady.
_PIECE = 128
_FEWEST = 8
#: From this share of the highest frequency on noise is what stands out, and to this one no window leaks. A
#: filter made for samples falls faster near the highest frequency than its gain here says: how loud the noise
#: was is seen from further below, where that is next to nothing, in the louder part of it.
_FROM, _TO = 0.6, 0.98
_FROM_BELOW, _LOUDER = 0.35, 0.75
#: The kernel is cut where it has died away, so many periods of the corner from its middle; what runs forwards
#: alone dies away more slowly, and what is cut off makes its delay shorter.
_PERIODS, _PERIODS_CAUSAL = 1.0, 2.0
#: What is left of a torque that was before is less than this share of it once it is forgotten.
_FORGOTTEN = 0.01
#: Parts of a row in which the answer of a filter that runs forwards alone is added up.
_FINE = 32
#: Corners are the same to within this share.
_NEAR = 0.01
#: Orders of filters that run forwards alone.
CAUSAL_ORDERS = (2.0, 1.0)


@dataclass(frozen=True)
class OwnFilter:
    """A Butterworth filter, as a drive runs it, or forwards and backwards.

    Attributes:
        corner_hz: frequency at which half of the power passes, or forwards and backwards of the amplitude.
        order: exponent with which the gain falls.
        causal: whether it ran forwards alone, with the delay that this makes; of order 1 or 2.
    """

    corner_hz: float
    order: float
    causal: bool = False

    def gain(self, frequency: Array) -> Array:
        """At frequencies in Hz."""
        ratio = frequency / self.corner_hz
        if self.causal:
            return np.asarray(1.0 / np.sqrt(1.0 + ratio ** (2.0 * self.order)))
        return np.asarray(1.0 / (1.0 + ratio**self.order))

    def kernel(self, rate: float) -> Array:
        """Weights of the rows around one, from those before it on, at a rate in Hz; odd in number, their sum
        is 1."""
        periods = _PERIODS_CAUSAL if self.causal else _PERIODS
        half = max(int(np.ceil(periods * rate / self.corner_hz)), 1)
        if self.causal:
            weights = np.concatenate([self._answer(half, rate)[::-1], np.zeros(half)])
        else:
            around = np.fft.irfft(self.gain(np.asarray(np.fft.rfftfreq(4 * half, 1.0 / rate), dtype=float)))
            weights = np.concatenate([around[-half:], around[: half + 1]])
        return np.asarray(weights / weights.sum())

    def _answer(self, rows: int, rate: float) -> Array:
        """What is left of a row at itself and so many rows after it, of a torque that goes straight from row
        to row."""
        fine = (np.arange(rows * _FINE) + 0.5) / _FINE
        turned = 2.0 * np.pi * self.corner_hz / rate * fine
        if self.order == 1.0:
            impulse = np.exp(-turned)
        else:
            impulse = np.exp(-turned / math.sqrt(2.0)) * np.sin(turned / math.sqrt(2.0))
        row = fine.astype(int)
        near, far = (np.bincount(row, impulse * share, rows) for share in (1.0 - fine + row, fine - row))
        return np.asarray(np.append(near, 0.0) + np.concatenate([[0.0], far]))

    def is_near(self, other: OwnFilter) -> bool:
        """Whether the two are one, to what any log tells of its corner."""
        alike = self.order == other.order and self.causal == other.causal
        return alike and abs(math.log(self.corner_hz / other.corner_hz)) < _NEAR

    def remembers(self, motion: Motion) -> NDArray[np.bool_]:
        """Rows at which a filter that ran forwards alone has not forgotten what was before their stretch."""
        if not self.causal:
            return np.zeros(len(motion), dtype=bool)
        begins = np.flatnonzero(motion.begins)
        since = motion.time - np.repeat(motion.time[begins], np.diff(np.append(begins, len(motion))))
        return np.asarray(2.0 * math.pi * self.corner_hz * since < -math.log(_FORGOTTEN))

    def noise_gain(self, motion: Motion) -> float:
        """How much of the standard deviation of white noise passes."""
        return float(np.linalg.norm(self.kernel(1.0 / motion.period)))

    def to_provenance(self) -> dict[str, float | bool]:
        """As a parameter file keeps it."""
        return {
            "low_pass_hz": float(f"{self.corner_hz:.6g}"),
            "low_pass_order": float(f"{self.order:.4g}"),
            **({"low_pass_causal": True} if self.causal else {}),
        }

    @classmethod
    def from_provenance(cls, known: Mapping[str, Any]) -> OwnFilter | None:
        """What a parameter file keeps of it; None for none, or for no filter that there is."""
        corner, order = known.get("low_pass_hz"), known.get("low_pass_order")
        causal = known.get("low_pass_causal") is True
        if not (isinstance(corner, int | float) and isinstance(order, int | float)):
            return None
        there = corner > 0.0 and order > 0.0 and (not causal or order in CAUSAL_ORDERS)
        return cls(float(corner), float(order), causal) if there else None

    def matrix(self, motion: Motion) -> SparseRows:
        """The filter as a matrix, shape (rows, rows); it does not reach over the border of a stretch."""
        rows, rates = len(motion), _rates(motion)
        kernels = {rate: self.kernel(rate) for rate in np.unique(rates).tolist()}
        weights = np.concatenate(list(kernels.values()))
        middles = np.cumsum([0, *(len(kernel) for kernel in kernels.values())])[:-1]
        which = np.searchsorted(list(kernels), rates)
        half = np.array([len(kernel) // 2 for kernel in kernels.values()])[which]
        begins = np.flatnonzero(motion.begins)
        lengths = np.diff(np.append(begins, rows))
        row = np.arange(rows)
        low = np.maximum(row - half, np.repeat(begins, lengths))
        count = np.minimum(row + half + 1, np.repeat(begins + lengths, lengths)) - low
        pointer = np.concatenate([[0], np.cumsum(count)])
        columns = np.arange(pointer[-1]) - np.repeat(pointer[:-1] - low, count)
        values = weights[columns + np.repeat(middles[which] + half - row, count)]
        inside = np.add.reduceat(values, pointer[:-1])
        if self.causal:  # before a stretch the axis stood, under the torque with which it begins
            values[pointer[:-1]] += 1.0 - inside
        else:
            values /= np.repeat(inside, count)
        return SparseRows.of(values, columns, pointer, rows)


def falls(torque: Array, motion: Motion) -> float:
    """Exponent with which the amplitude of the torque's noise falls near the highest frequency; 0 if white.

    The median over pieces of the log: a stop, a spike or a jerk is in few of them.
    """
    frequency, power = _typical_power(torque, motion, _FROM)
    if not len(power):
        return 0.0
    return float(-0.5 * np.polyfit(np.log(frequency), np.log(power), 1)[0])


def noise_before(own: OwnFilter, torque: Array, motion: Motion) -> float | None:
    """Standard deviation of the white noise that the log shows filtered; None where its trials are too short
    to show any."""
    frequency, power = _typical_power(torque, motion, _FROM_BELOW)
    if not len(power):
        return None
    return float(np.sqrt(np.quantile(power / own.gain(frequency) ** 2, _LOUDER)))


def _typical_power(torque: Array, motion: Motion, share: float) -> tuple[Array, Array]:
    """Frequencies from that share of the highest on, and the typical power: white noise has its variance."""
    rate = 1.0 / motion.period
    each = [
        power_densities(torque[start:end], rate, _PIECE)
        for start, end in zip(motion.starts, motion.ends, strict=True)
        if end - start >= _PIECE
    ]
    if sum(len(pieces) for _, pieces in each) < _FEWEST:
        return np.empty(0), np.empty(0)
    frequency = each[0][0]
    # the power of noise at one frequency is distributed exponentially: its median is ln 2 of its mean
    density = np.median(np.concatenate([pieces for _, pieces in each]), axis=0) / np.log(2.0)
    power = 0.5 * rate * density
    kept = (frequency > share * frequency[-1]) & (frequency < _TO * frequency[-1]) & (power > 0.0)
    return frequency[kept], power[kept]


def _rates(motion: Motion) -> Array:
    """Rate of each row's trial, Hz, to three digits: logs of one axis may be of different ones."""
    starts, ends = motion.starts, motion.ends
    steps = [
        np.median(motion.step[start + 1 : end]) if end - start > 1 else np.inf
        for start, end in zip(starts, ends, strict=True)
    ]
    return np.repeat(
        [float(f"{1.0 / step:.3g}") if np.isfinite(step) else 1.0 for step in steps], ends - starts
    )
