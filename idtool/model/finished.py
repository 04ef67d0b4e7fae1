"""What acts on the finished torque: a late report of the motion, and what the motor gives per current."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from idtool.model.contribution import Contribution, Term, is_zero
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion

#: The torque per current never falls below this share of the plain one.
_LEAST_GAIN = 0.2


class Finished:
    """The torque behind them.

    Args:
        motion: the rows.
        effect: the sum of all effects.
        torque: before them, shape (rows,).
        start_column: derivative of `torque` with respect to the start deflection, shape (rows,).
        along: what directions add in which it will be differentiated.

    Attributes:
        torque, start_column: behind them.
        acts: whether anything acts there at all.
    """

    def __init__(
        self,
        motion: Motion,
        effect: Contribution,
        torque: Array,
        start_column: Array,
        along: Sequence[Contribution] = (),
    ) -> None:
        acting = [effect, *along]
        self._later = None
        if any(not is_zero(one.delay) for one in acting):
            self._later = _Shift(motion, float(np.mean(effect.delay)))
            self._slope = self._later.slope(torque)
            torque, start_column = self._later(torque), self._later(start_column)
        self._gain: Term = 1.0
        if any(not is_zero(one.saturation) or not is_zero(one.gain_change) for one in acting):
            # K i (gain - s |K i|) = torque, solved for K i; the smaller root is the physical one
            gain = np.maximum(1.0 + effect.gain_change, _LEAST_GAIN)
            inside = np.sqrt(np.maximum(gain * gain - 4.0 * effect.saturation * np.abs(torque), 0.04))
            torque, self._gain = 2.0 * torque / (gain + inside), 1.0 / inside
            start_column = start_column * self._gain
        self.torque, self.start_column = torque, start_column
        self.acts = self._later is not None or not isinstance(self._gain, float)

    def derivative(self, column: Array, along: Contribution) -> Array:
        """Of the torque behind, from that of the torque before; `along` holds the direction's effects."""
        if self._later is not None:
            column = self._later(column)
            if not is_zero(along.delay):
                column = column + self._slope * along.delay
        if not is_zero(along.saturation):
            column = column + np.abs(self.torque) * self.torque * along.saturation
        if not is_zero(along.gain_change):
            column = column - self.torque * along.gain_change
        return column if isinstance(self._gain, float) else column * self._gain


@jit()
def _between(values: Array, left: NDArray[np.intp], right: NDArray[np.intp], weight: Array) -> Array:
    """Linear interpolation; indexing by arrays in numpy takes twenty times as long."""
    out = np.empty(len(left))
    for k in range(len(left)):
        out[k] = values[left[k]] * (1.0 - weight[k]) + values[right[k]] * weight[k]
    return out


@jit()
def _interval(
    time: Array, first: NDArray[np.bool_], delay: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, Array]:
    """Rows of its own trial between which `time + delay` of each row lies, how far along, their distance."""
    rows = len(time)
    left, right = np.empty(rows, dtype=np.intp), np.empty(rows, dtype=np.intp)
    weight, span = np.empty(rows), np.empty(rows)
    begin = 0
    while begin < rows:
        last = begin
        while last + 1 < rows and not first[last + 1]:
            last += 1
        at = min(begin + 1, last)
        for k in range(begin, last + 1):
            wanted = min(max(time[k] + delay, time[begin]), time[last])
            while at < last and time[at] < wanted:
                at += 1
            before = max(at - 1, begin)
            apart = time[at] - time[before]
            left[k], right[k] = before, at
            weight[k] = (wanted - time[before]) / apart if apart > 0 else 0.0
            span[k] = apart if apart > 0 else 1.0
        begin = last + 1
    return left, right, weight, span


class _Shift:
    """Read a row quantity at `time + delay` inside its own trial (held beyond its ends)."""

    def __init__(self, motion: Motion, delay: float) -> None:
        self.left, self.right, self.weight, self.span = _interval(motion.time, motion.first, delay)

    def __call__(self, values: Array) -> Array:
        return _between(np.ascontiguousarray(values), self.left, self.right, self.weight)

    def slope(self, values: Array) -> Array:
        return np.asarray((values[self.right] - values[self.left]) / self.span)
