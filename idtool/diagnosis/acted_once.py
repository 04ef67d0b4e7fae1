"""What acted once: a hand, an obstacle, another axis that moved.

A torque that acts for a second and never again is no property of the axis, and pulls at every parameter. No
function of the motion can be it where the same place, speed and acceleration were passed at other times
without it: what a row leaves is compared with what its neighbours in the motion leave, and the mean of a
stretch of time with those before and after it, so that neither a step nor a drift is taken for it. Whatever
else the model lacks it lacks in many places: the largest of all stretches has to be many times the largest
that does not overlap it. Were sizes as heavy in the tail as 1 / size^3, heavier than those of any recording
that we know, the largest would be r times the next by chance in r^-3 of all sessions (the spacing of
exponential order statistics; David & Nagaraja, Order Statistics, 3rd ed. 2003, section 2.5).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.model.units import unit_text
from idtool.presentation.text import counted
from idtool.signals import Recording

#: Rows are neighbours within these shares of the ranges of position, speed and acceleration, so far apart in
#: time, s; so many are asked, and so many have to answer.
_NEAR, _APART_S, _ASKED, _LEAST = (0.03, 0.15, 0.3), 5.0, 80, 3
#: Lengths of the stretches that are compared, s, and the share of their rows that needs neighbours.
_LENGTHS_S, _MOSTLY = (0.3, 0.6, 1.2, 2.4), 0.6
#: So many times the next: by chance in one session of a hundred. As many can stand out together.
_STANDS_OUT, _MOST = 100.0 ** (1.0 / 3.0), 4
#: Loads are alike within this share of their range.
_ALIKE = 0.03
#: What acts on a larger share of the rows is no exception.
_RARE = 0.2
#: Stretches are one that are no further apart, s.
_MEET_S = 1.0
#: What is a smaller share of the friction changes no number by much.
_MATTERS = 0.05
#: Why rows are not compared, as it is told.
REASON = "acted once"


@dataclass(frozen=True)
class Stretch:
    """A part of a trial in which something acted.

    Attributes:
        trial: its trial.
        begin, end: s, by the clock of the trial.
        torque: mean, N m (N), of what acted there and neither before nor after.
    """

    trial: int
    begin: float
    end: float
    torque: float


def without_what_acted(recording: Recording, stretches: Sequence[Stretch]) -> Recording:
    """The recording with stretches not compared, each told."""
    remarks, rows = [], np.zeros(len(recording.motion), dtype=bool)
    motion = recording.motion
    for stretch in stretches:
        within = (motion.time >= stretch.begin) & (motion.time <= stretch.end)
        acted = recording.usable & (motion.trial == stretch.trial) & within
        source = recording.sources[recording.source[stretch.trial]]
        remarks.append(
            f"{source}, {stretch.begin:.1f} s to {stretch.end:.1f} s: a torque of "
            f"{stretch.torque:.2g} {unit_text('torque', recording.axis.units)} that the same motion does not "
            "take at any other time; a hand, an obstacle or another axis can be that: "
            f"{counted(int(acted.sum()), 'row was', 'rows were')} left out."
        )
        rows |= acted
    lost = recording.lost | {REASON: int(rows.sum())}
    told = (*recording.remarks, *remarks)
    return replace(recording, usable=recording.usable & ~rows, lost=lost, remarks=told)


def joined(stretches: Iterable[Stretch]) -> list[Stretch]:
    """Those of one trial that meet, or nearly, as one, with the larger torque; in order of time."""
    found: list[Stretch] = []
    for one in sorted(stretches, key=lambda one: (one.trial, one.begin)):
        if found and found[-1].trial == one.trial and one.begin <= found[-1].end + _MEET_S:
            before = found.pop()
            larger = max(before, one, key=lambda each: abs(each.torque))
            one = replace(larger, begin=before.begin, end=max(before.end, one.end))
        found.append(one)
    return found


def acted_once(fit: JointFit) -> list[Stretch]:
    """The stretches in which something acted that acts nowhere else, the largest first."""
    recording = fit.model.recording
    left, trial = fit.residual / recording.row_weight, recording.filtered_trial
    time = recording.motion.time[recording.row]
    least = _MATTERS * fit.model.friction_sizes[0]
    step = float(np.median(np.diff(time)))
    lengths = [max(round(length / step), 1) for length in _LENGTHS_S]
    alones = [_contrasts(left, trial, rows) for rows in lengths]
    # most sessions end here: nothing in them is that large, neighbours or not
    if all(np.nanmax(np.abs(alone), initial=0.0) < least for alone in alones):
        return []
    beside = _beside_neighbours(recording, left)
    best: list[Stretch] = []
    most = _STANDS_OUT
    for rows, alone in zip(lengths, alones, strict=True):
        # neighbours may differ by what they leave themselves: it has to be in the stretch too
        own = _smaller(_contrasts(beside, trial, rows), alone)
        # what has no neighbours may come again or not: it is large as it is
        others = np.nan_to_num(np.abs(np.where(np.isfinite(own), own, alone)))
        peaks = list[int]()
        while len(peaks) < _MOST:
            peaks.append(int(np.argmax(np.nan_to_num(np.abs(own)) * (others > 0.0))))
            size = abs(own[peaks[-1]])
            others[_meeting(peaks[-1], trial, rows)] = 0.0
            if not size > least or not others.any():
                break
            if size > most * others.max():
                most = size / float(others.max())
                best = [_stretch(own, trial, time, peak, rows, float(others.max())) for peak in peaks]
    inside = sum(
        np.count_nonzero((trial == one.trial) & (time >= one.begin) & (time <= one.end)) for one in best
    )
    return best if inside < _RARE * len(time) else []


def _meeting(peak: int, trial: NDArray[np.intp], rows: int) -> NDArray[np.bool_]:
    """Rows from which a stretch meets one that begins at `peak`, or those around it."""
    return np.asarray((np.abs(np.arange(len(trial)) - peak) <= 4 * rows) & (trial == trial[peak]))


def _smaller(one: Array, other: Array) -> Array:
    """The smaller of two differences; 0 where they have other signs, NaN where either is."""
    smaller = np.where(np.abs(one) < np.abs(other), one, other)
    return np.where(one * other < 0.0, 0.0, smaller + 0.0 * one * other)


def _beside_neighbours(recording: Recording, left: Array) -> Array:
    """What rows leave beyond the median of what those leave that pass the same place at the same speed and
    acceleration at other times, (filtered rows,); NaN where too few do."""
    from scipy import spatial  # most sessions need not pay its import

    motion, row = recording.motion, recording.row
    columns = [values[row] for values in (motion.position, motion.velocity, motion.acceleration)]
    within = (
        values / (near * (float(np.ptp(values)) or 1.0)) for values, near in zip(columns, _NEAR, strict=True)
    )
    # nor is one way the other; under another load friction may be another, which the library has effects for
    loads = [values[row] for values in (motion.payload, motion.gravity_factor) if values is not None]
    apart_by = (values / (_ALIKE * (float(np.ptp(values)) or 1.0)) for values in loads)
    scaled = np.column_stack([*within, 2.0 * np.sign(columns[1]), *apart_by])
    tree = spatial.KDTree(scaled)
    distance, other = tree.query(scaled, k=_ASKED, p=np.inf, distance_upper_bound=1.0)
    found = np.isfinite(distance)
    other = np.where(found, other, 0)
    time, trial = motion.time[row], recording.filtered_trial
    apart = (np.abs(time[:, None] - time[other]) > _APART_S) | (trial[:, None] != trial[other])
    answers = found & apart
    beside = np.full(len(row), np.nan)
    known = np.count_nonzero(answers, axis=1) >= _LEAST
    beside[known] = left[known] - np.nanmedian(np.where(answers, left[other], np.nan)[known], axis=1)
    return beside


def _contrasts(left: Array, trial: NDArray[np.intp], rows: int) -> Array:
    """By how much the mean of so many rows, from each one on, differs from that of twice as many before and
    after them in the same trial, by the smaller difference; 0 where the two have other signs, NaN where too
    few rows are known. Shape (filtered rows,)."""
    found = np.full(len(left), np.nan)
    bounds = np.append(np.flatnonzero(np.diff(trial, prepend=-1)), len(trial))
    for begin, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        if end - begin < 3 * rows:
            continue
        known = np.isfinite(left[begin:end])
        sums = np.concatenate([[0.0], np.cumsum(np.where(known, left[begin:end], 0.0))])
        counts = np.concatenate([[0], np.cumsum(known)])
        first = np.arange(end - begin - rows + 1)
        last = first + rows
        before, after = np.maximum(first - 2 * rows, 0), np.minimum(last + 2 * rows, end - begin)

        def mean(low: NDArray[np.intp], high: NDArray[np.intp], s: Array = sums, c: Array = counts) -> Array:
            number = c[high] - c[low]
            return np.where(number >= _MOSTLY * rows, (s[high] - s[low]) / np.maximum(number, 1), np.nan)

        inside = mean(first, last)
        one, other = inside - mean(before, first), inside - mean(last, after)
        found[begin + first] = _smaller(one, other)
    return found


def _stretch(
    contrast: Array, trial: NDArray[np.intp], time: Array, peak: int, rows: int, others: float
) -> Stretch:
    """From where to where stretches around a peak stand out of all others."""
    stands = (contrast * np.sign(contrast[peak]) > others) & (trial == trial[peak])
    edges = np.flatnonzero(~stands)
    first = int(edges[edges < peak].max(initial=-1)) + 1
    last = int(edges[edges > peak].min(initial=len(stands))) - 1
    end = min(last + rows, len(time)) - 1
    return Stretch(int(trial[peak]), float(time[first]), float(time[end]), float(contrast[peak]))
