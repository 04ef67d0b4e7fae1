"""The strongest sine in a residual, over time or over the angle: every frequency is looked at."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from idtool.diagnosis.evidence import Background
from idtool.model.motion import Array
from idtool.signals.bounded import bounded_minimum
from idtool.signals.fast_length import fast_length

#: Bins in the shortest period: rows share a bin with their neighbours, which costs under 1 % of amplitude.
_BINS = 8
#: The spectrum has this many points in each resolution cell, so that no line falls between two.
_FINE = 3
_MOST_BINS = 1 << 22
#: ... and the strongest is then placed to this share of the distance between two.
_CLOSE = 0.02
#: Lines whose gain is computed exactly, with what the fit could do taken out.
_CHECKED = 12


def strongest_line(
    background: Background,
    of: Array,
    lowest: float,
    highest: float,
    size: Array | float = 1.0,
    part: NDArray[np.intp] | None = None,
) -> tuple[float, int]:
    """Frequency of the sine that takes away most of a fit's residual, and how many were looked at.

    The residual is summed into bins of `of` and transformed at once. It is free of the fit's columns
    already, so its product with a wave is that with what the fit leaves of the wave.

    Args:
        background: the fit.
        of: what the sine is of (angle, time), rad per unit of frequency, shape (filtered rows,).
        lowest, highest: frequencies between which to look.
        size: the sine is multiplied by, shape (filtered rows,).
        part: rows with one number share a phase, shape (filtered rows,); None: all do.
    """
    n = len(of)
    size = size * background.recording.row_weight
    residual = size * background.residual[:n]
    parts = [slice(None)] if part is None else [part == k for k in np.unique(part)]
    from_zero = of.copy()
    for own in parts:
        from_zero[own] -= of[own].min()
    span = float(from_zero.max())
    width = 2.0 * math.pi / (_BINS * highest)
    count = min(int(span / width) + 1, _MOST_BINS)
    width = max(width, span / count)
    place = (from_zero / width).astype(np.intp)
    length = fast_length(_FINE * (int(place.max()) + 1))
    apart = 2.0 * math.pi / (length * width)
    frequency = 2.0 * math.pi * np.arange(length // 2 + 1) / (length * width)
    inside = slice(*np.searchsorted(frequency, [lowest, np.nextafter(highest, np.inf)]))
    frequency = frequency[inside]
    if not len(frequency):
        return lowest, 1
    power = np.zeros(len(frequency))
    for own in parts:
        bins = np.bincount(place[own], residual[own])
        largest = max(float(np.max(np.abs(bins))), 1e-300)
        # in half the bits, which tell the best dozen as well, and in half the time
        spectrum = np.fft.rfft((bins / largest).astype(np.float32), length)[inside]
        # of each part its waves take away its power over their size
        power += largest**2 / float(np.sum(size[own] ** 2)) * (spectrum.real**2 + spectrum.imag**2)
    best = (0.0, lowest)
    for _ in range(_CHECKED):
        at = int(np.argmax(power))
        best = max(best, (_gain(background, waves_of(frequency[at] * of, size, part)), float(frequency[at])))
        power[max(at - _FINE, 0) : at + _FINE + 1] = 0.0  # the line and its flanks
    # what a line that is a little off leaves beats, and looks like chance
    around = (max(best[1] - apart, lowest), min(best[1] + apart, highest))
    found = bounded_minimum(
        lambda f: -_gain(background, waves_of(f * of, size, part)), *around, within=_CLOSE * apart
    )
    return found, max(int(len(power) / _FINE), 1)


def waves_of(angle: Array, size: Array | float = 1.0, part: NDArray[np.intp] | None = None) -> Array:
    """Sine and cosine of each part, times `size`, shape (rows, twice the parts); see `strongest_line`."""
    waves = np.column_stack([size * np.sin(angle), size * np.cos(angle)])
    if part is None:
        return waves
    return np.hstack([waves * (part == k)[:, None] for k in np.unique(part)])


def _gain(background: Background, waves: Array) -> float:
    """What waves take away of the residual's sum of squares."""
    n = len(waves)
    basis, residual = background.basis[:n], background.residual[:n]
    waves -= basis @ (basis.T @ waves)
    along = waves.T @ residual
    return float(along @ np.linalg.lstsq(waves.T @ waves, along, rcond=1e-9)[0])
