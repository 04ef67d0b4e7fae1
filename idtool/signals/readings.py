"""Readings of a motion over time, and how likely they are under a jerk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.model.motion import Array
from idtool.signals import kalman
from idtool.signals.bounded import bounded_minimum

#: Squared normalised innovations count at most this much in the likelihood, so that a few steps in
#: the motion do not make all of it look rough.
_ROBUST = 9.0
#: Where to look for the jerk, decimal logarithms about a first guess: what the steps of a reading say, or
#: another fit. Far below, every innovation counts as one of those few steps, and all looks likely.
ANYWHERE, NEAR = np.array([-5.0, 9.0]), np.array([-2.0, 2.0])


@dataclass(frozen=True)
class Series:
    """Readings over time as the filter takes them, see `kalman.forward`."""

    time: Array
    readings: Array
    variances: Array
    first: NDArray[np.bool_]

    @property
    def usual(self) -> Array:
        """Mean variance of each reading where it is used, 0 where it never is, shape (2,)."""
        return np.asarray(self.variances.sum(axis=0) / np.maximum((self.variances > 0).sum(axis=0), 1))


def unlikely_by(series: Series, jerk: float) -> float:
    """Minus twice the logarithm of the likelihood of readings under one intensity of the jerk, up to a
    constant; steps in the motion count little."""
    one = np.full(len(series.time), jerk)
    return kalman.unlikely(series.time, series.readings, series.variances, series.first, one, _ROBUST)


def likeliest_jerk(series: Series, around: Array) -> float:
    """The one intensity for all rows under which the readings are likeliest.

    Args:
        series: the readings.
        around: decimal logarithms between which to look, shape (2,).
    """

    def cost(log_jerk: float) -> float:
        return unlikely_by(series, 10.0**log_jerk)

    low, high = around.tolist()
    return float(10.0 ** bounded_minimum(cost, low, high, within=0.1))
