"""Readings that cannot be: found from the recording itself, by one bound.

A running median of seven rows follows every motion and drops every reading that goes away and comes back
within three rows. A reading is impossible if it lies further from that median than twice the most that the
median itself ever moves in a row, with what noise and the steps of the sensor add: no motion of this
recording would have brought the axis there and back. Where position and speed are both read, what one of
them says is taken off the other first, so that motion cancels and the same bound is much tighter; and a
position that jumps further than the axis travels in the time, or darts at a speed that the axis does not get
to and back, is impossible however long it stays there. A time that leaves the clock of the rows around it,
while the position does not, is none. A torque may jump and stay; of one that stays only what is far beyond
the range of all others is impossible.

Source: Hampel, J. Amer. Stat. Assoc. 69, 1974 (the median as reference); Davies & Gather, J. Amer. Stat.
Assoc. 88, 1993 (a scale that outliers do not inflate).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from idtool.log.clock import GAP
from idtool.log.sensor_faults import repeated, resolution
from idtool.model.motion import Array
from idtool.model.running import running_mean, running_median

Rows = NDArray[np.bool_]

#: Rows of the running median; a fault of up to half of them is seen. The wider one is where motion cancels.
_WIDTH = 7
_WIDE = 31
#: A reading this many times as far away as motion, noise and steps together explain is impossible.
#: Over a hundred recordings of real and simulated axes no genuine reading is 1.4 times as far.
_BEYOND = 2.0
#: The most that the median moves in a row: a few larger steps may be faults that outlast the median.
_RANK = 3
#: Noise is what this share of the readings stay below, and so many times it what a single one may reach.
_SHARE = 0.95
_NOISE = 5.0
#: A torque so many times the range of this share of all rows away from the middle is none of this axis; the
#: farthest genuine one seen was 3.4 times.
_USUAL = 0.97
_RANGE = 7.0
#: A speed is held against the position's own over so many rows on both sides: drives report it late.
_AROUND = 4
#: A rate that the axis held for so many rows is one that it can go; a position may jump this many times as
#: far as it then gets.
_HELD = 3
_JUMP = 3.0
#: A speed reading and the position's own rates further apart than this say nothing about each other.
_MISTAKEN = 5.0
#: Where a speed was read, the way that it adds up to is known to this share.
_LATE = 0.1
#: Jumps that are alike to within this share, and so many times what the axis goes in a row, are the wrapping
#: of a counter.
_ALIKE = 0.02
_WITHIN = 2.0
#: Passes: a large fault hides a small one.
_PASSES = 4


@dataclass(frozen=True)
class Impossible:
    """What cannot be in the readings of one log.

    Attributes:
        position, velocity, effort: rows at which each cannot be, shape (rows,).
        slips: rows at which the position jumps for good, and by how much.
        wraps: whether those are of a counter that wraps.
        expected: role -> what the rows around say, shape (rows,).
    """

    position: Rows
    velocity: Rows
    effort: Rows
    slips: dict[int, float]
    wraps: bool
    expected: dict[str, Array]


def find(
    time: Array, first: Rows, position: Array | None, velocity: Array | None, effort: Array
) -> Impossible:
    """Look for readings that cannot be.

    Args:
        time: s, rising inside a trial, shape (rows,).
        first: True at the first row of each trial.
        position, velocity: readings, shape (rows,), or None.
        effort: torque, shape (rows,).
    """
    clock = _Clock(time, first)
    readings = {"position": position, "velocity": velocity, "effort": effort}
    kept = {role: values.copy() for role, values in readings.items() if values is not None}
    bad = {role: np.zeros(len(time), dtype=bool) for role in readings}
    slips: dict[int, float] = {}
    wraps = False
    for _ in range(_PASSES):
        fresh = {role: beyond(values, first) for role, values in kept.items()}
        fresh["effort"] |= _out_of_range(kept["effort"])
        _fill_in(kept, bad, fresh, time, first)
        if position is not None:
            away, slips, wraps = _jumps(clock, kept["position"], kept.get("velocity"))
            fresh["position"] = fresh["position"] | away
            _fill_in(kept, bad, {"position": away}, time, first)
            for row, jump in slips.items():  # as if it had not slipped, for the comparison with the speed
                kept["position"][clock.rest(row)] -= jump
        if position is not None and velocity is not None:
            late = {"velocity": _denied_by_position(clock, kept["position"], kept["velocity"])}
            _fill_in(kept, bad, late, time, first)
            late["position"] = _denied_by_speed(clock, kept["position"], kept["velocity"])
            _fill_in(kept, bad, late, time, first)
            fresh = {role: rows | late.get(role, False) for role, rows in fresh.items()}
        for row, jump in slips.items():
            kept["position"][clock.rest(row)] += jump
        if not any(rows.any() for rows in fresh.values()):
            break
    return Impossible(bad["position"], bad["velocity"], bad["effort"], slips, wraps, kept)


def stamps(time: Array, first: Rows, position: Array) -> tuple[Rows, Array]:
    """Rows whose time is not when their position was read, and the times without them, shape (rows,).

    Such a time leaves the even clock of the rows around it and comes back, and the way that the axis went
    meanwhile is that of the even clock. Where it is that of the time as it stands, the row was read late.

    Args:
        time: s, rising inside a trial, shape (rows,).
        first: True at the first row of each trial.
        position: a reading, shape (rows,).
    """
    clock = _Clock(time, first)
    off = np.asarray(time - clock.period * np.arange(len(time)))
    odd = np.zeros(len(time), dtype=bool)
    for width in (_WIDTH, _WIDE):
        middle = _running_median(off, first, width)
        away = np.abs(off - middle)
        jitter = _NOISE * np.quantile(away, _SHARE) + np.quantile(np.abs(np.diff(middle)), _SHARE)
        odd |= away > _BEYOND * jitter + (GAP - 1.0) * clock.period / _BEYOND
    if not odd.any():
        return odd, time
    kept, bad = {"time": time.copy()}, {"time": np.zeros(len(time), dtype=bool)}
    row = np.arange(len(time), dtype=float)
    _fill_in(kept, bad, {"time": odd}, row, first)
    for run in np.split(np.flatnonzero(odd), np.flatnonzero(np.diff(np.flatnonzero(odd)) > 1) + 1):
        ends = np.array([run[0] - 1, run[-1] + 1])
        inside = ends[0] >= 0 and ends[1] < len(time) and not first[run[0] : ends[1] + 1].any()
        far = [
            float(np.abs(position[run] - np.interp(clocked[run], clocked[ends], position[ends])).max())
            for clocked in (time, kept["time"])
            if inside
        ]
        if not inside or far[0] <= _BEYOND * far[1] + resolution(position):
            odd[run] = False
    return odd, np.where(odd, kept["time"], time)


def beyond(
    values: Array, first: Rows, width: int = _WIDTH, step: float = 0.0, late: Array | float = 0.0
) -> Rows:
    """Rows further from the running median than motion, noise and the sensor's steps explain.

    Args:
        values: shape (rows,).
        first: True at the first row of each stretch that has nothing to do with the one before.
        width: rows of the median, odd.
        step: the smallest step of what `values` were made of, where that is more than their own.
        late: how far away what they were made of may bring each by being read late, shape (rows,).
    """
    middle = _running_median(values, first, width)
    begins = np.flatnonzero(first)
    ends = np.append(begins[1:], len(first)) - 1
    row, lengths = np.arange(len(first)), ends - begins + 1
    near_end = np.minimum(row - np.repeat(begins, lengths), np.repeat(ends, lengths) - row)
    # what begins a stretch or ends it has nothing to come back to: there it may be anything in the range
    edge = near_end < width // 2
    moves = np.abs(np.diff(middle))[~edge[1:] & ~edge[:-1]]
    if len(moves) <= width:
        return np.zeros(len(values), dtype=bool)
    middle[begins], middle[ends] = middle[np.minimum(begins + 1, ends)], middle[np.maximum(ends - 1, begins)]
    away = np.abs(values - middle)
    most = float(np.partition(moves, -_RANK)[-_RANK])
    noise = _NOISE * float(np.quantile(away, _SHARE)) + 2.0 * max(resolution(values), step)
    return np.asarray(away > _BEYOND * (np.where(edge, float(np.ptp(middle[~edge])), most) + noise) + late)


def _out_of_range(values: Array) -> Rows:
    """Rows many times as far from the middle as nearly all others, however long they stay there."""
    low, middle, high = np.quantile(values, [1.0 - _USUAL, 0.5, _USUAL])
    return np.asarray((high > low) & (np.abs(values - middle) > _RANGE * (high - low)))


class _Clock:
    """Times of a log, and which of its rows belong together."""

    def __init__(self, time: Array, first: Rows) -> None:
        self.time, self.first = time, first
        inside = ~first[1:]
        steps = np.diff(time)
        self.period = float(np.median(steps[inside])) if inside.any() else 1.0
        self.steps = np.where(inside, steps, self.period)
        #: True where a row follows no other at once: a trial or a gap begins.
        self.breaks = first.copy()
        self.breaks[1:] |= self.steps > GAP * self.period
        self._starts = np.append(np.flatnonzero(first), len(first))

    def rest(self, row: int) -> slice:
        """The rows of the trial from this one on."""
        return slice(row, int(self._starts[np.searchsorted(self._starts, row, side="right")]))

    def begin(self, row: int) -> int:
        """The first row of the trial."""
        return int(self._starts[np.searchsorted(self._starts, row, side="right") - 1])


def _running_median(values: Array, first: Rows, width: int) -> Array:
    result = np.empty(len(values))
    starts = np.flatnonzero(first)
    for begin, end in zip(starts, np.append(starts[1:], len(values)), strict=True):
        part = values[begin:end]
        result[begin:end] = running_median(part, width) if len(part) > width else part
    return result


def _fill_in(
    kept: dict[str, Array], bad: dict[str, Rows], fresh: dict[str, Rows], time: Array, first: Rows
) -> None:
    """Put what the rows around say in the place of the readings that cannot be."""
    trial = np.cumsum(first)
    for role, rows in fresh.items():
        if not rows.any():
            continue
        bad[role] |= rows
        good = ~bad[role]
        for one in np.unique(trial[rows]):
            here = trial == one
            if (good & here).any():
                kept[role][rows & here] = np.interp(
                    time[rows & here], time[good & here], kept[role][good & here]
                )


def _denied_by_position(clock: _Clock, position: Array, velocity: Array) -> Rows:
    """Rows at which the speed is none that the position goes anywhere near."""
    rows = len(position)
    change = np.where(clock.breaks[1:], np.nan, np.diff(position))
    # a row was read when its time says, or as evenly as the clock goes
    rates = np.stack([change / np.maximum(clock.steps, clock.period / _BEYOND), change / clock.period])
    padded = np.pad(rates, ((0, 0), (_AROUND, _AROUND)), constant_values=np.nan)
    around = np.lib.stride_tricks.sliding_window_view(padded, 2 * _AROUND, axis=1)[:, :rows]
    slowest, fastest = around.min(axis=(0, 2)), around.max(axis=(0, 2))
    whole = np.isfinite(slowest)  # beside a gap the position does not say enough
    apart = np.where(whole, velocity - np.clip(velocity, slowest, fastest), 0.0)
    noise = np.quantile(np.abs(velocity - _running_median(velocity, clock.first, _WIDTH)), _SHARE)
    usual = np.quantile(np.abs(apart), _SHARE)
    step = 2.0 * resolution(velocity) + resolution(position) / clock.period
    off = np.abs(apart) > _BEYOND * (_NOISE * (float(noise) + float(usual)) + step)
    return np.asarray(off & ~repeated(velocity, clock.first))  # a stuck sensor is told of as that


def _denied_by_speed(clock: _Clock, position: Array, velocity: Array) -> Rows:
    """Rows at which the position leaves the way that the speed goes, and comes back to it."""
    apart, step = position - _travel(clock, velocity), resolution(position)
    away = np.zeros(len(position), dtype=bool)
    for width in (_WIDTH, _WIDE):
        # a speed that is read late takes off a motion that was
        faster = np.abs(velocity - _running_median(velocity, clock.breaks, width))
        away |= beyond(apart, clock.breaks, width, step, _AROUND * clock.period * faster)
    return np.asarray(away & ~repeated(position, clock.first))


def _jumps(clock: _Clock, position: Array, velocity: Array | None) -> tuple[Rows, dict[int, float], bool]:
    """Rows between a jump of the position and the one back, jumps from which it does not come back, and
    whether those are the wrapping of a counter."""
    away, slips = np.zeros(len(position), dtype=bool), dict[int, float]()
    change = np.where(clock.first[1:], 0.0, np.diff(position))
    # a reading that is repeated was not taken anew: the axis had the time since it was last new
    new = clock.first.copy()
    new[1:] |= change != 0.0
    last = np.maximum.accumulate(np.where(new, np.arange(len(new)), 0))
    held = np.maximum(clock.time[1:] - clock.time[last[:-1]], clock.period)
    rate = np.where(clock.first[1:], 0.0, change / held)
    if len(rate) < _HELD:
        return away, slips, False
    runs = np.lib.stride_tricks.sliding_window_view(rate, _HELD)
    held_rates = np.maximum(np.maximum(runs.min(axis=1), (-runs).min(axis=1)), 0.0)
    speed = float(held_rates.max())
    if velocity is not None:
        speed = float(np.sort(held_rates)[-min(_RANK, len(held_rates))])
        top = float(np.quantile(np.abs(velocity), 0.999))
        # a speed in another unit, or a dead one, is no bound
        speed = top if speed < _MISTAKEN * top and top < _MISTAKEN * max(speed, 1e-300) else max(speed, top)
    # the instant of a reading is known to within a row
    bound = _JUMP * (speed * (held + clock.period) + 2.0 * resolution(position))
    # or goes on as before after one row at a speed that the axis does not get to and back in that time
    grain = resolution(position) / clock.period
    darts = beyond(np.concatenate([rate[:1], rate]), clock.breaks, width=3, step=grain)[1:]
    # beside a gap there is none to go on from
    darts &= ~(running_mean(clock.breaks.astype(float), 2 * _HELD + 1) > 0.0)[1:]
    jumps = (np.flatnonzero((np.abs(change) > bound) | darts) + 1).tolist()

    def slip(row: int) -> float:
        """The jump without the motion of that row, which is much as that of the row before."""
        return float(change[row - 1] - (0.0 if clock.first[row - 1] else change[row - 2]))

    # a counter wraps by one amount, there and back; a reading of nothing is as far away as the axis just was
    within = _WITHIN * speed * clock.period + 2.0 * resolution(position)
    if _alike([slip(row) for row in jumps], within) and max(np.diff(jumps)) > _WIDE:
        return away, {row: slip(row) for row in jumps}, True
    way = _travel(clock, velocity) if velocity is not None else np.zeros(len(position))
    doubt = speed if velocity is None else _LATE * speed
    while jumps:
        row = jumps.pop(0)
        for back in jumps:
            if clock.begin(back) != clock.begin(row):
                break
            apart = position[back] - position[row - 1] - (way[back] - way[row - 1])
            if abs(apart) <= bound[back - 1] + doubt * (clock.time[back] - clock.time[row]):
                away[row:back] = True
                jumps = [k for k in jumps if k > back]
                break
        if not away[row]:
            slips[row] = slip(row)
    return away, slips, _alike([*slips.values()], within)


def _alike(jumps: list[float], within: float) -> bool:
    """Whether several jumps are one jump again and again, there and back."""
    sizes = np.abs(jumps)
    return len(jumps) > 1 and float(np.ptp(sizes)) < min(within, _ALIKE * float(np.median(sizes)))


def _travel(clock: _Clock, velocity: Array) -> Array:
    """What the speed adds up to, shape (rows,); nothing over a gap or between trials."""
    mean = 0.5 * (velocity[1:] + velocity[:-1])
    return np.concatenate([[0.0], np.cumsum(np.where(clock.breaks[1:], 0.0, mean * clock.steps))])
