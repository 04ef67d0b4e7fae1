"""Medians and means over the rows around each one, and the deviation that a median tells; as scipy.ndimage
and scipy.stats, whose import takes longer than a fit."""

from __future__ import annotations

import numpy as np

from idtool.model.jit import jit
from idtool.model.motion import Array

#: Standard deviation of normal noise over its median size: one over the normal distribution's upper quartile.
_PER_MEDIAN = 1.4826


def running_median(values: Array, width: int, *, beyond: float | None = None) -> Array:
    """Median of `width` rows around each one; the upper one of an even number, as the half before a row is
    the longer.

    Args:
        values: shape (rows,), at least one, without a NaN.
        width: rows.
        beyond: what is taken to be there beyond both ends; the end itself if None.
    """
    first, last = (values[0], values[-1]) if beyond is None else (beyond, beyond)
    before = width // 2
    padded = np.concatenate([np.full(before, first), values, np.full(width - 1 - before, last)])
    return _medians(padded, np.sort(padded[:width]))


def running_mean(values: Array, width: int, *, mirrored: bool = False) -> Array:
    """Mean of `width` rows around each one, the half before a row the longer; beyond an end it is taken to
    stay as it is there, or to go back the way it came."""
    before = width // 2
    padded = np.pad(values, (before + 1, width - 1 - before), "symmetric" if mirrored else "edge")
    total = np.cumsum(padded)
    return np.asarray((total[width:] - total[:-width]) / width)


@jit()
def _medians(padded: Array, window: Array) -> Array:
    """Of so many rows as the window has, which holds the first of them in order: one leaves, one comes in."""
    width = len(window)
    result = np.empty(len(padded) - width + 1)
    result[0] = window[width // 2]
    for k in range(1, len(result)):
        leaves, comes, at = padded[k - 1], padded[k + width - 1], 0
        while at + 1 < width and window[at] < leaves:
            at += 1
        while at + 1 < width and window[at + 1] < comes:
            window[at] = window[at + 1]
            at += 1
        while at > 0 and window[at - 1] > comes:
            window[at] = window[at - 1]
            at -= 1
        window[at] = comes
        result[k] = window[width // 2]
    return result


def deviation(values: Array) -> float:
    """Standard deviation of noise around zero by its median size, which outliers leave alone; 0 of nothing.

    Args:
        values: any shape; NaN where there is none.
    """
    return float(_PER_MEDIAN * np.nanmedian(np.abs(values))) if len(values) else 0.0
