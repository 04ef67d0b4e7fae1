"""From logs to the rows that a fit works on.

A `Recording` holds several logs as one set of arrays: the smoothed motion at full rate (the bristle
needs every row), the measured torque, which rows are fit to be compared, and one linear operator that
filters and decimates. That operator acts once on the torque and once on every regressor, so it biases
nothing; see docs and `Recording.filtered`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse

from idtool.errors import InputError
from idtool.log import Log, columns_of
from idtool.log.columns import Columns
from idtool.log.effort import Effort, effort_of
from idtool.log.repair import Reading, Repaired, repair
from idtool.log.sensor_faults import resolution
from idtool.model.contribution import Contribution
from idtool.model.motion import MOST_DELAY_S, Array, Motion
from idtool.model.units import EffortUnit
from idtool.parameters.axis import Axis, voltage_key
from idtool.presentation.text import counted
from idtool.signals import lowpass
from idtool.signals.lowpass import Filter
from idtool.signals.own_filter import OwnFilter, noise_before
from idtool.signals.rest import standing
from idtool.signals.smoother import TOO_FAST, Smoothed, reading_variance, smooth

#: Fewer rows tell nothing of an axis.
_FEWEST = 50
#: A torque sample further than this many standard deviations from its neighbours is an outlier.
_OUTLIER = 8.0
_SPIKE = "outlier of the torque"
#: An axis moves for certain above this share of the top speed.
_MOVING = 0.02
#: A trial that lasts so many times the longest delay does not miss its ends.
_LONG = 20.0


@dataclass(frozen=True)
class Recording:
    """Logs of one axis, ready to fit.

    Attributes:
        axis: kind of axis, torque constant, and what the torque is counted in (`Axis.effort`).
        motion: smoothed motion, every row.
        torque: measured torque K i, or what stands for it (`idtool.log.effort`), every row.
        usable: rows fit to be compared (not at rest, not saturated, no outlier, not faster than the
            sampling).
        at_rest: rows at which the axis stands: friction there is any torque below break-away, which no model
            predicts; they are bounds on it (`idtool.fit.breakaway`).
        experiment: name of the experiment of each trial.
        source: index of the log that each trial came from.
        noise: standard deviation of the torque's white noise at full rate, before `own_filter`.
        filter: what the low-pass is.
        position_resolution: smallest step of the position reading, 0 without one.
        lost: reason -> rows that it cost.
        remarks: sentences on what was repaired, missing or left out whole.
        sources: file of each log.
        impossible: of each log, the readings that cannot be and were left out.
        wiring: of each log, sentences on columns that contradict each other.
        fold: what is left out together when a model is judged on what it did not see, (rows,); None is the
            trial.
        unseen: how far the axis may move in a rest without its position showing it, rad (m).
        by_voltage: the torque is the motor's voltage, with its back-EMF in it unless the axis tells R.
        weight: of each row in a fit, one over what models leave there, (rows,); None is the same for all.
        own_filter: the low-pass that the torque went through before it was logged, None for none.
    """

    axis: Axis
    motion: Motion
    torque: Array
    usable: NDArray[np.bool_]
    at_rest: NDArray[np.bool_]
    experiment: tuple[str, ...]
    source: tuple[int, ...]
    noise: float
    filter: Filter
    position_resolution: float
    lost: dict[str, int] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    impossible: tuple[tuple[Reading, ...], ...] = ()
    wiring: tuple[tuple[str, ...], ...] = ()
    fold: NDArray[np.intp] | None = None
    unseen: float = 0.0
    by_voltage: bool = False
    weight: Array | None = None
    own_filter: OwnFilter | None = None

    @cached_property
    def torque_size(self) -> float:
        """Root mean square of the measured torque, rows that a fit uses."""
        return float(np.sqrt(np.mean(self.torque[self.usable] ** 2)))

    @cached_property
    def floor(self) -> float:
        """Standard deviation of the noise that the logs show."""
        return self.noise * (1.0 if self.own_filter is None else self.own_filter.noise_gain(self.motion))

    @cached_property
    def operator(self) -> sparse.csr_matrix:
        """The filter and decimation as a matrix, shape (filtered rows, rows); a weight is in it."""
        matrix = lowpass.operator(self.motion, self.usable, self.filter)
        if not matrix.shape[0] and not self.motion.velocity.any():
            raise InputError(
                "nothing moves", file=", ".join(self.sources), remedy="record the axis while it moves"
            )
        if not matrix.shape[0]:
            reasons = "".join(f", {reason}: {count}" for reason, count in self.lost.items())
            rate = 1.0 / float(np.median(self.motion.step[~self.motion.first]))
            raise InputError(
                f"no row is left to be compared ({len(self.torque)} rows at {rate:.3g} Hz{reasons})",
                file=", ".join(self.sources),
                remedy="record at a higher rate, for longer, or move more slowly",
            )
        if self.weight is not None:
            matrix.data *= np.repeat(self.weight[_middle(matrix)], np.diff(matrix.indptr))
        return matrix

    @cached_property
    def model_operator(self) -> sparse.csr_matrix:
        """The same for what a model predicts: it goes through the log's own filter first."""
        return self.operator if self._own is None else sparse.csr_matrix(self.operator @ self._own)

    @cached_property
    def _own(self) -> sparse.csr_matrix | None:
        return None if self.own_filter is None else self.own_filter.matrix(self.motion)

    @property
    def csr(self) -> tuple[Array, NDArray[np.int32], NDArray[np.int32]]:
        """Data, indices and pointers of the model's operator."""
        return self.model_operator.data, self.model_operator.indices, self.model_operator.indptr

    @cached_property
    def row_weight(self) -> Array:
        """Weight of each filtered row; `filtered` has it in it."""
        return np.ones(len(self.row)) if self.weight is None else self.weight[self.row]

    @cached_property
    def row(self) -> NDArray[np.intp]:
        """The full-rate row at the middle of each filtered row."""
        return _middle(self.operator)

    @cached_property
    def filtered_trial(self) -> NDArray[np.intp]:
        """Trial of each filtered row."""
        return self.motion.trial[self.row]

    @cached_property
    def filtered_stretch(self) -> NDArray[np.intp]:
        """Stretch of each filtered row (`Motion.stretch`)."""
        return self.motion.stretch[self.row]

    @cached_property
    def filtered_fold(self) -> NDArray[np.intp]:
        """Fold of each filtered row."""
        return self.filtered_trial if self.fold is None else self.fold[self.row]

    @cached_property
    def entering(self) -> Array:
        """Velocity at the start of each trial that begins in motion, 0 for other stretches, (stretches,)."""
        begins = np.flatnonzero(self.motion.begins)
        moves = self.motion.first[begins] & ~self.at_rest[begins] & self.moving[begins]
        return np.asarray(np.where(moves, self.motion.velocity[begins], 0.0))

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Rows that are faster than the noise of a standing axis, for certain, (rows,)."""
        speed = np.abs(self.motion.velocity)
        return np.asarray(speed > _MOVING * np.quantile(speed, 0.999))

    @cached_property
    def stretch_pointer(self) -> NDArray[np.intp]:
        """First filtered row of each stretch, and the number of rows at its end, (stretches + 1,)."""
        return np.searchsorted(self.filtered_stretch, np.arange(self.motion.stretches + 1))

    @cached_property
    def _kept(self) -> dict[object, Any]:
        return {}

    def once(self, key: object, compute: Callable[[], Any]) -> Any:
        """What `compute` returned when it was asked for by that key first: many models are tried on the same
        rows."""
        if key not in self._kept:
            self._kept[key] = compute()
        return self._kept[key]

    @cached_property
    def filtered_torque(self) -> Array:
        """Measured torque, filtered."""
        return np.asarray(self.operator @ self.torque)

    @cached_property
    def added(self) -> dict[str, tuple[object, Array]]:
        """Filtered columns that a fit computed last, by name, with what each depends on."""
        return {}

    @cached_property
    def derivatives(self) -> dict[str, tuple[object, Contribution]]:
        """The same at full rate."""
        return {}

    def filtered(self, values: Array) -> Array:
        """Filter what a model predicts, one column or several, shape (rows,) or (rows, n)."""
        return np.asarray(self.model_operator @ values)

    def logged(self, torque: Array) -> Array:
        """A predicted torque as these logs would show it, shape (rows,)."""
        return torque if self._own is None else np.asarray(self._own @ torque)

    def told_of_rows(self) -> list[str]:
        """Sentences on rows that were in the logs and are not compared, and on what was repaired."""
        lost = sum(self.lost.values())
        if not lost:
            return list(self.remarks)
        reasons = ", ".join(f"{reason} {count}" for reason, count in self.lost.items())
        rows = "row was" if lost == 1 else "rows were"
        return [*self.remarks, f"{lost} {rows} left out of the comparison ({reasons})."]

    @property
    def contradictions(self) -> list[str]:
        """Sentences on columns that contradict each other, to be read before any number."""
        return [sentence for log in self.wiring for sentence in log]

    @property
    def odd(self) -> list[str]:
        """The logs whose columns do."""
        return [source for source, said in zip(self.sources, self.wiring, strict=True) if said]

    @property
    def trials(self) -> int:
        """Number of trials."""
        return self.motion.trials

    def subset(self, trials: Sequence[int] | NDArray[np.intp]) -> Recording:
        """Only these trials, renumbered from 0; filter and noise stay as they are."""
        wanted = np.asarray(sorted(int(t) for t in trials), dtype=np.intp)
        rows = np.isin(self.motion.trial, wanted)
        renumbered = np.searchsorted(wanted, self.motion.trial[rows]).astype(np.intp)
        return replace(
            self,
            motion=replace(self.motion.part(rows), trial=renumbered),
            torque=self.torque[rows],
            usable=self.usable[rows],
            at_rest=self.at_rest[rows],
            fold=None if self.fold is None else self.fold[rows],
            weight=None if self.weight is None else self.weight[rows],
            experiment=tuple(self.experiment[t] for t in wanted),
            source=tuple(self.source[t] for t in wanted),
        )

    def without_rows(self, rows: NDArray[np.bool_]) -> Recording:
        """The same motion with some rows not compared."""
        return replace(self, usable=self.usable & ~rows)

    def with_load(self, load: Array | None, upright: Array | None) -> Recording:
        """A copy whose motion knows the load that gravity puts on the axis."""
        return replace(self, motion=replace(self.motion, load=load, load_upright=upright))

    def through(self, own: OwnFilter) -> Recording:
        """The same, where the torque went through a low-pass before it was logged."""
        return replace(self, own_filter=own, noise=noise_before(own, self.torque, self.motion))


def _middle(operator: sparse.csr_matrix) -> NDArray[np.intp]:
    first, last = operator.indices[operator.indptr[:-1]], operator.indices[operator.indptr[1:] - 1]
    return np.asarray((first + last) // 2, dtype=np.intp)


def record(logs: Sequence[Log], *, every_row: bool = False) -> Recording:
    """Join logs of one axis into a `Recording`.

    Logs may be of different rates: the filter counts rows, so it takes away as much noise from each and a
    filtered row of any log weighs the same; it is designed for the slowest of them.

    Args:
        logs: of one axis.
        every_row: keep trials in which a sensor is stuck, for a prediction of each row.

    Raises:
        InputError: no log, logs of different axes, a torque that never changes, or too few rows.
    """
    if not logs:
        raise InputError("no log was given", remedy="name at least one log file")
    axis = _common_axis(logs)
    _refuse_few(sum(len(log.frame) for log in logs), logs)
    efforts = [effort_of(log) for log in logs]
    axis = replace(axis, effort=_common_unit(logs, efforts))
    _refuse_twice(logs, efforts)
    repaired = [
        repair(log, Columns.of(log, effort), effort, every_row=every_row)
        for log, effort in zip(logs, efforts, strict=True)
    ]
    rows = Columns.joined([one.columns for one in repaired])
    _refuse_few(len(rows), logs)
    experiment, source = _label_trials(logs, repaired)
    smoothed = smooth(rows.time, rows.position, rows.velocity, rows.first)
    torque = rows.effort - rows.back_emf * smoothed.velocity
    motion = Motion(
        time=rows.time,
        trial=rows.trial,
        position=smoothed.position,
        velocity=smoothed.velocity,
        acceleration=smoothed.acceleration,
        payload=rows.payload,
        gravity_factor=_gravity_factor(rows.tilt_alpha, rows.tilt_beta),
        tilt_alpha=rows.tilt_alpha,
        tilt_beta=rows.tilt_beta,
        temperature=rows.temperature,
        torque_constant=_constant_of_current(axis, efforts),
    )
    usable, lost, calm = _usable_rows(torque, smoothed.surprise, _faulty(repaired), motion)
    for one in repaired:
        for reason, count in one.dropped.items():
            lost[reason] = lost.get(reason, 0) + count
    at_rest, unseen = standing(motion, rows.position, calm)
    usable &= ~at_rest
    motion = replace(motion, restart=at_rest & ~np.append(at_rest[1:] & ~motion.first[1:], False))
    rate = lowpass.common_rate(motion, np.asarray(source)[rows.trial])
    bandwidth, noise = lowpass.bandwidth_and_noise(calm, motion, rate)
    return Recording(
        axis,
        motion,
        torque,
        usable,
        at_rest,
        experiment,
        source,
        noise,
        lowpass.design(bandwidth, rate),
        resolution(rows.position),
        lost,
        tuple(log.source for log in logs),
        tuple(remark for one in repaired for remark in one.remarks) + _of_the_readings(smoothed, axis),
        tuple(one.impossible for one in repaired),
        tuple(one.wiring for one in repaired),
        unseen=unseen,
        by_voltage=any(effort.column == "duty" for effort in efforts),
    )


def _refuse_twice(logs: Sequence[Log], efforts: Sequence[Effort]) -> None:
    """Rows that count twice halve every variance, and are seen by the fit that they are held out of."""
    seen: dict[int, str] = {}
    for log, effort in zip(logs, efforts, strict=True):
        time = log.frame["time_s"].to_numpy(dtype=float)
        rows = hash((time.tobytes(), effort.values.tobytes()))
        if rows in seen:
            raise InputError(f"holds the rows of {seen[rows]}", file=log.source, remedy="give each log once")
        seen[rows] = log.source


def _refuse_few(rows: int, logs: Sequence[Log]) -> None:
    if rows < _FEWEST:
        raise InputError(
            f"only {counted(rows, 'row')}",
            file=", ".join(log.source for log in logs),
            remedy=f"a fit needs {_FEWEST} at least; record for longer",
        )


def _of_the_readings(smoothed: Smoothed, axis: Axis) -> tuple[str, ...]:
    """What is said of readings that are not what they say."""
    position, velocity = (columns_of(axis.kind)[role] for role in ("position", "velocity"))
    said = []
    if smoothed.clock > 0.0:
        said.append(
            f"time_s is {1e3 * smoothed.clock:.2g} ms (standard deviation) off when {position} was read, "
            "which counts as noise of what moves; log the time of the measurement, with all its digits."
        )
    if smoothed.contradicted:
        said.append(
            f"{velocity} is not how fast {position} changes (a drive's filter delays it, or its noise lasts "
            f"longer than a row); it was left out, and the slope of {position} taken."
        )
    return tuple(said)


def _common_axis(logs: Sequence[Log]) -> Axis:
    axis = logs[0].axis
    for log in logs[1:]:
        if log.axis.kind != axis.kind:
            raise InputError(
                f"is of a {log.axis.kind} axis, {logs[0].source} of a {axis.kind} one",
                file=log.source,
                remedy="give logs of one axis",
            )
        mine = (axis.torque_constant, axis.torque_per_volt, axis.resistance)
        keys = (axis.constant_key, voltage_key(axis.kind), "resistance_ohm")
        its = (log.axis.torque_constant, log.axis.torque_per_volt, log.axis.resistance)
        for key, one, other in zip(keys, mine, its, strict=True):
            if one != other:
                raise InputError(
                    f"{key} differs from that of {logs[0].source}",
                    file=log.source,
                    place=f"axis.{key}",
                    remedy="give logs of one axis, or correct the constant",
                )
    return axis


def _common_unit(logs: Sequence[Log], efforts: Sequence[Effort]) -> EffortUnit:
    for log, effort in zip(logs, efforts, strict=True):
        if effort.unit != efforts[0].unit:
            raise InputError(
                f'gives a {effort.unit} ("{effort.column}") and {logs[0].source} a {efforts[0].unit}',
                file=log.source,
                remedy="give logs of one quantity, or the torque constant (--axis) that makes torque of both",
            )
    return efforts[0].unit


def _constant_of_current(axis: Axis, efforts: Sequence[Effort]) -> float | None:
    """Effort over motor current, where a current was measured; effects that depend on it need that."""
    if any(effort.column == "duty" for effort in efforts):
        return None
    return 1.0 if axis.effort == "current" else axis.torque_constant


def _label_trials(
    logs: Sequence[Log], repaired: Sequence[Repaired]
) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Experiment and log of each trial."""
    experiment: list[str] = []
    source: list[int] = []
    for index, (log, one) in enumerate(zip(logs, repaired, strict=True)):
        count = int(one.columns.trial.max()) + 1
        experiment += [log.experiment or "other"] * count
        source += [index] * count
    return tuple(experiment), tuple(source)


def _gravity_factor(alpha: Array | None, beta: Array | None) -> Array | None:
    if alpha is None and beta is None:
        return None
    factor = np.ones(len(alpha if alpha is not None else beta))  # type: ignore[arg-type]
    for tilt in (alpha, beta):
        if tilt is not None:
            factor = factor * np.cos(tilt)
    # logs write pi/2 with a few digits: what is left of gravity then is rounding, not physics
    return np.where(np.abs(factor) < 1e-3, 0.0, factor)


def _faulty(repaired: Sequence[Repaired]) -> dict[str, NDArray[np.bool_]]:
    """Reason -> rows of all logs that a sensor's fault spoils."""
    reasons = dict.fromkeys(reason for one in repaired for reason in one.faulty)
    blank = [np.zeros(len(one.columns), dtype=bool) for one in repaired]
    return {
        reason: np.concatenate(
            [one.faulty.get(reason, none) for one, none in zip(repaired, blank, strict=True)]
        )
        for reason in reasons
    }


def _beside_the_unseen(motion: Motion) -> NDArray[np.bool_]:
    """Rows at either end of a long trial that a late reading makes depend on motion nobody logged."""
    ends = np.append(motion.starts[1:], len(motion)) - 1
    rows = np.diff(np.append(motion.starts, len(motion)))
    since = motion.time - np.repeat(motion.time[motion.starts], rows)
    left = np.repeat(motion.time[ends], rows) - motion.time
    return (np.minimum(since, left) < MOST_DELAY_S) & (since + left > _LONG * MOST_DELAY_S)


def _usable_rows(
    torque: Array, surprise: Array, faulty: dict[str, NDArray[np.bool_]], motion: Motion
) -> tuple[NDArray[np.bool_], dict[str, int], Array]:
    """Rows fit to be compared, what cost the others, and the torque without its spikes."""
    lost: dict[str, int] = {}
    usable = np.ones(len(torque), dtype=bool)

    def drop(reason: str, rows: NDArray[np.bool_]) -> None:
        fresh = rows & usable
        if fresh.any():
            lost[reason] = int(fresh.sum())
            usable[rows] = False

    for reason, rows in faulty.items():
        drop(reason, rows)
    fast = surprise > TOO_FAST
    usable &= ~_beside_the_unseen(motion)
    # a trial starts from a state nobody knows; where its first rows jump, the jump is such a state
    rows_in = np.arange(len(torque)) - np.repeat(
        motion.starts, np.diff(np.append(motion.starts, len(torque)))
    )
    settling = (rows_in < 3) & np.isin(motion.trial, motion.trial[fast & (rows_in < 10)])
    drop("start of a trial in mid-motion", settling)
    middle = ndimage.median_filter(torque, 5, mode="constant")
    away = torque - middle
    spread = 1.4826 * float(np.median(np.abs(away[away != 0]))) if np.any(away != 0) else 0.0
    spread = max(spread, float(np.sqrt(reading_variance(torque, motion.first))))
    # the range that spikes leave alone: they must not hide one another
    wild = np.abs(away) > max(_OUTLIER * spread, 0.05 * float(np.ptp(middle)))
    drop(_SPIKE, wild)
    return usable, lost, np.where(wild, middle, torque)
