"""Cumulative periodogram of a residual, in time and over the angle: is it noise and nothing else?

For white noise the power adds up along a straight line; Bartlett's test (1955) is the largest distance
from it, with Kolmogorov's distribution. Here the line is the one that white sensor noise gives after the
package's own filter, so that the filter's memory is not taken for structure. Over the angle the rows are
put in order of the position: what repeats or bends with it then stands in neighbouring rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from idtool.fit.chance import KOLMOGOROV_95, kolmogorov_tail
from idtool.fit.joint import JointFit
from idtool.model.motion import Array

#: Lags of the filter that are followed.
_LAGS = 40
#: Points of the curve that a report draws.
_DRAWN = 120


@dataclass(frozen=True)
class CumulativePeriodogram:
    """One curve.

    Attributes:
        over: "time" or "angle".
        frequency: share of the highest frequency, 0 to 1.
        power: share of the power up to it, 0 to 1.
        white: the same for white noise after the filter.
        band: 95 % of residuals of white noise stay this close to `white`.
        p_value: of noise alone.
    """

    over: str
    frequency: Array
    power: Array
    white: Array
    band: float
    p_value: float

    def to_document(self) -> dict[str, Any]:
        """As in evidence.json, thinned to what a figure shows."""
        thin = np.unique(np.linspace(0, len(self.power) - 1, _DRAWN).astype(int))
        curves = {"frequency": self.frequency[thin], "power": self.power[thin], "white": self.white[thin]}
        return {"over": self.over, **curves, "band": self.band, "p_value": self.p_value}


def cumulative_periodograms(fit: JointFit) -> list[CumulativePeriodogram]:
    """In time, and over the angle where the position was logged."""
    recording = fit.model.recording
    found = [cumulative_periodogram("time", fit.residual, _white_covariance(fit))]
    position = recording.motion.position[recording.row]
    if recording.position_resolution > 0.0 and np.ptp(position) > 0.0:
        # rows that are neighbours over the angle are hardly ever neighbours in time: no memory of the filter
        ordered = fit.residual[np.argsort(position, kind="stable")]
        found.append(cumulative_periodogram("angle", ordered, np.ones(1)))
    return found


def cumulative_periodogram(over: str, residual: Array, covariance: Array) -> CumulativePeriodogram:
    """Of a residual, shape (n,), whose noise would have the autocovariance `covariance` at lags 0, 1, ...,
    in any unit."""
    n = len(residual)
    power = np.abs(np.fft.rfft(residual - residual.mean())[1:]) ** 2
    turn = np.linspace(0.0, np.pi, len(power) + 1)[1:]
    lags = np.arange(1, len(covariance))
    expected = covariance[0] + 2.0 * np.cos(np.outer(turn, lags)) @ covariance[1:]
    expected = np.maximum(expected, 1e-6 * covariance[0])
    # each ordinate over its expectation is one draw; summed with the expectation's weight the curve of
    # noise is `white`, and its distance from it that of a weighted Kolmogorov test
    share, white = np.cumsum(power) / power.sum(), np.cumsum(expected) / expected.sum()
    effective = expected.sum() ** 2 / float(expected @ expected)
    distance = float(np.max(np.abs(share - white)))
    return CumulativePeriodogram(
        over,
        turn / np.pi,
        share,
        white,
        KOLMOGOROV_95 / np.sqrt(effective),
        kolmogorov_tail(float(distance * np.sqrt(effective))) if n > 2 else 1.0,
    )


def _white_covariance(fit: JointFit) -> Array:
    """Mean autocovariance that white noise has after the filter, at lags of filtered rows."""
    operator = fit.model.recording.model_operator
    rows = len(operator)
    found = []
    for lag in range(min(_LAGS, rows - 1)):
        found.append(operator.overlap(lag) / (rows - lag))
        if lag and abs(found[-1]) < 1e-4 * found[0]:
            break
    return np.array(found)
