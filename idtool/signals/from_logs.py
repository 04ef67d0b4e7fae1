"""From logs of one axis to a `Recording`: columns repaired, motion smoothed, the rows fit to be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of
from idtool.log.columns import Columns
from idtool.log.effort import Effort, effort_of
from idtool.log.repair import Repaired, repair
from idtool.log.sensor_faults import resolution
from idtool.model.motion import Array, Motion
from idtool.model.running import deviation, running_median
from idtool.model.units import EffortUnit
from idtool.parameters.axis import Axis, voltage_key
from idtool.presentation.text import counted
from idtool.signals import lowpass
from idtool.signals.recording import Recording
from idtool.signals.rest import standing
from idtool.signals.smoother import TOO_FAST, Smoothed, reading_variance, smooth

#: Fewer rows tell nothing of an axis.
_FEWEST = 50
#: A torque sample further than this many standard deviations from its neighbours is an outlier.
_OUTLIER = 8.0
_SPIKE = "outlier of the torque"
#: No torque is known to less than so small a share of it: a calculated one has the noise of its last digits.
_LEAST_NOISE = 1e-12
#: How late a servo on a slow bus reports its motion, s: two or three turns. A trial that lasts so many times
#: that does not miss its ends.
_LATE_S, _LONG = 0.05, 20.0


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
    _refuse_few(sum(log.row_count for log in logs), logs)
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
    of_voltage = any(effort.column == "duty" for effort in efforts)
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
        torque_constant=None if of_voltage else _constant_of_current(axis),
        of_voltage=of_voltage,
        back_emf=rows.back_emf if rows.back_emf.any() else None,
    )
    usable, lost, calm = _usable_rows(rows.effort, smoothed.surprise, _faulty(repaired), motion)
    for one in repaired:
        for reason, count in one.dropped.items():
            lost[reason] = lost.get(reason, 0) + count
    at_rest, unseen = standing(motion, rows.position, calm)
    usable &= ~at_rest
    motion = replace(motion, restart=at_rest & ~np.append(at_rest[1:] & ~motion.first[1:], False))
    rate = lowpass.common_rate(motion, np.asarray(source)[rows.trial])
    bandwidth, noise = lowpass.bandwidth_and_noise(calm, motion, rate)
    noise = max(noise, _LEAST_NOISE * float(np.sqrt(np.mean(calm**2))))
    return Recording(
        axis,
        motion,
        rows.effort,
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
        unsure=smoothed.unsure,
        by_voltage=any(effort.column == "duty" for effort in efforts),
        rig=_common_rig(logs),
    )


def _common_rig(logs: Sequence[Log]) -> str:
    """The word that opens the rig of the logs; on one that replays a recording nothing else can be run."""
    specs = [log.header.get("rig_spec") for log in logs]
    spec = specs[0] if all(one == specs[0] for one in specs) else None
    return spec if isinstance(spec, str) and not spec.startswith("replay:") else ""


def _refuse_twice(logs: Sequence[Log], efforts: Sequence[Effort]) -> None:
    """Rows that count twice halve every variance, and are seen by the fit that they are held out of."""
    seen: dict[int, str] = {}
    for log, effort in zip(logs, efforts, strict=True):
        time = log.values_of("time_s")
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


def _constant_of_current(axis: Axis) -> float | None:
    """Effort over motor current, where that is known."""
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
    rows = motion.ends - motion.starts
    since = motion.time - np.repeat(motion.time[motion.starts], rows)
    left = np.repeat(motion.time[motion.ends - 1], rows) - motion.time
    return (np.minimum(since, left) < _LATE_S) & (since + left > _LONG * _LATE_S)


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
    rows_in = np.arange(len(torque)) - np.repeat(motion.starts, motion.ends - motion.starts)
    settling = (rows_in < 3) & np.isin(motion.trial, motion.trial[fast & (rows_in < 10)])
    drop("start of a trial in mid-motion", settling)
    middle = running_median(torque, 5, beyond=0.0)
    away = torque - middle
    spread = max(deviation(away[away != 0]), float(np.sqrt(reading_variance(torque, motion.first))))
    # the range that spikes leave alone: they must not hide one another
    wild = np.abs(away) > max(_OUTLIER * spread, 0.05 * float(np.ptp(middle)))
    drop(_SPIKE, wild)
    return usable, lost, np.where(wild, middle, torque)
