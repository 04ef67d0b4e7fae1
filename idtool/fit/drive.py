"""The servo's own position loop from logs: gain, limit and delay (`idtool.parameters.drive`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of
from idtool.log.effort import DRIVE_OFF, DUTY_FULL, effort_of
from idtool.log.sensor_faults import clipped
from idtool.model.motion import Array, Motion
from idtool.parameters import Parameter
from idtool.parameters.drive import Command, Drive
from idtool.signals import Recording, record
from idtool.signals.bounded import bounded_minimum

#: Delays between which to look, s, and how fine the first look is.
_SHORTEST, _LONGEST, _STEP = 0.0, 0.06, 0.004
#: How near the end of that range a delay is at its bound, s.
_FINE = 1e-3
#: A gain of speed that takes less of the residual than this is none.
_WORTH = 0.02
#: How near the highest command of all logs one's own is the same limit.
_NEAR = 0.02
#: So many rows at exactly the highest command of a log may be its limit.
_STOPPED = 10
#: A law that leaves more than this share of the command's variance is not the loop's.
_MOST_LEFT = 0.5


def gain_setting(log: Log) -> float | None:
    """The servo's own number for its position gain, if the log tells it (`[drive] gain_setting`)."""
    table = log.header.get("drive")
    setting = table.get("gain_setting") if isinstance(table, dict) else None
    return float(setting) if isinstance(setting, int | float) and setting > 0 else None


def fit_drive(logs: Sequence[Log]) -> Drive:
    """Identify the loop from logs with a goal.

    Raises:
        InputError: no goal, one that is not what drives the servo, or a drive that is never on inside its
            limits.
    """
    duty = all(log.column("duty") is not None for log in logs)
    command: Command = "duty" if duty else "effort"
    settings = [gain_setting(log) for log in logs]
    told = all(setting is not None for setting in settings)
    reference = float(np.median([setting for setting in settings if setting is not None])) if told else None
    scales = [(setting or 1.0) / (reference or 1.0) if told else 1.0 for setting in settings]
    recording = record(logs, every_row=True)
    motions = [_of_log(recording, index) for index in range(len(logs))]
    every = [_Rows(*one) for one in zip(logs, [command] * len(logs), scales, motions, strict=True)]
    parts = [part for part in every if part.usable.any()]
    if not parts:
        raise InputError(
            "the drive is never on inside its limits", file=logs[0].source, remedy="log gentler motions"
        )

    def at(delay: float) -> tuple[float, Array, Array, Array]:
        columns = np.vstack([part.columns(delay) for part in parts])
        commanded = np.concatenate([part.command[part.usable] for part in parts])
        found = np.linalg.lstsq(columns, commanded, rcond=None)[0]
        left = commanded - columns @ found
        return float(left @ left), found, left, columns

    tried = np.arange(_SHORTEST, _LONGEST, _STEP)
    costs = [at(delay)[0] for delay in tried]
    best = float(tried[int(np.argmin(costs))])
    bounds = (max(best - _STEP, _SHORTEST), best + _STEP)
    delay = bounded_minimum(lambda d: at(d)[0], *bounds, within=0.1 * _FINE)
    cost, found, left, columns = at(delay)
    commanded = left + columns @ found
    if cost > _MOST_LEFT * float(np.sum((commanded - commanded.mean()) ** 2)):
        raise InputError(
            "the goal does not explain what the drive did, so it is no loop of gains on position and speed",
            file=", ".join(log.source for log in logs),
            remedy="simulate with --from effort",
        )
    alone = float(columns[:, 0] @ (left + columns @ found) / (columns[:, 0] @ columns[:, 0]))
    cost_alone = float(np.sum((left + columns @ found - alone * columns[:, 0]) ** 2))
    with_speed = cost < (1.0 - _WORTH) * cost_alone and found[1] > 0.0
    if not with_speed:
        found = np.array([alone, 0.0])
        columns = columns[:, :1]
    errors = _standard_errors(columns, left, [int(part.usable.sum()) for part in parts])
    curvature = (at(delay + 1e-3)[0] + at(max(delay - 1e-3, 0.0))[0] - 2.0 * cost) / 1e-6
    spread = math.sqrt(2.0 * cost / len(left) / curvature) if curvature > 0.0 else math.inf
    return Drive(
        command,
        _parameter(float(found[0]), errors[0]),
        _parameter(float(found[1]), errors[1] if with_speed else None),
        _limit(command, parts, delay, found),
        _parameter(delay, spread, at_bound=delay > _LONGEST - _FINE),
        reference,
    )


def goal_of(log: Log) -> Array:
    """The goal of the servo's position loop, rad (m), shape (rows,).

    Raises:
        InputError: the log has none.
    """
    goal = log.column("position_command")
    if goal is None:
        name = columns_of(log.axis.kind)["position_command"]
        raise InputError(
            f'has no column "{name}", the goal of the servo\'s position loop',
            file=log.source,
            remedy="log it, or simulate with --from effort",
        )
    return goal


def _limit(command: Command, parts: Sequence[_Rows], delay: float, gains: Array) -> Parameter:
    """The most that the drive commands: where it was seen to stop short of what the law asks for.

    What was merely the largest command of some gentle logs must not hold back a higher gain, or a faster
    goal: a duty then ends where all duties do, and nothing says where an effort would.
    """
    most = max(part.most for part in parts)
    ends = [part for part in parts if part.most >= (1.0 - _NEAR) * most]
    if any(part.clipped or part.asks_for_more(delay, gains) for part in ends):
        return Parameter(most)
    return Parameter(1.0) if command == "duty" else Parameter(most).undetermined(at_least=most)


class _Rows:
    """One log: what its loop commanded and what it saw."""

    def __init__(self, log: Log, command: Command, setting: float, motion: Motion) -> None:
        goal = goal_of(log)
        effort = effort_of(log)
        values = log.column("duty") if command == "duty" else effort.values
        assert values is not None
        self.time, self.goal, self.first = motion.time, goal, motion.first
        self.position, self.velocity = motion.position, motion.velocity
        self.command = np.asarray(values, dtype=float)
        self.setting = setting
        self.most = float(np.max(np.abs(self.command)))
        self.clipped = bool(clipped(self.command).any())
        self.usable: NDArray[np.bool_] = np.ones(len(self.time), dtype=bool)
        for reason in (DRIVE_OFF, DUTY_FULL):
            if reason in effort.unfit:
                self.usable &= ~effort.unfit[reason]
        # where the law asks for more than the limit, the limit is what is seen
        at_most = np.abs(self.command) >= self.most
        self.stopped = at_most & self.usable & (np.count_nonzero(at_most) >= _STOPPED)
        self.usable &= ~self.stopped

    def asks_for_more(self, delay: float, gains: Array) -> bool:
        """Whether the law asks for more than the highest command on the rows that have exactly that."""
        if not self.stopped.any():
            return False
        asked = self.columns(delay, self.stopped)[:, : len(gains)] @ gains
        return bool(np.median(np.abs(asked)) > self.most)

    def columns(self, delay: float, rows: NDArray[np.bool_] | None = None) -> Array:
        """Error of the position and speed, usable rows by default, the gain of this log over the file's."""
        goal = np.array(self.goal)
        edges = [*np.flatnonzero(self.first).tolist(), len(goal)]
        for begin, end in pairwise(edges):
            time = self.time[begin:end]
            goal[begin:end] = np.interp(time - delay, time, self.goal[begin:end])
        both = np.column_stack([self.setting * (goal - self.position), -self.velocity])
        return np.asarray(both[self.usable if rows is None else rows])


def _of_log(recording: Recording, index: int) -> Motion:
    trials = [trial for trial, source in enumerate(recording.source) if source == index]
    return recording.subset(trials).motion


def _standard_errors(columns: Array, left: Array, sizes: Sequence[int]) -> list[float]:
    """Of least squares whose residual is correlated in time: sums over blocks of each log."""
    bread = np.linalg.pinv(columns.T @ columns)
    meat = np.zeros_like(bread)
    begin = 0
    for size in sizes:
        for block in np.array_split(np.arange(begin, begin + size), max(min(10, size // 20), 1)):
            score = columns[block].T @ left[block]
            meat += np.outer(score, score)
        begin += size
    return [math.sqrt(max(v, 0.0)) for v in np.diag(bread @ meat @ bread)]


def _parameter(value: float, stderr: float | None, *, at_bound: bool = False) -> Parameter:
    if stderr is None or not math.isfinite(stderr):
        return Parameter(value, at_bound=at_bound)
    if at_bound:  # only the longest delay looked for is one
        return Parameter(value, at_bound=True).undetermined(at_least=value - 1.96 * stderr)
    return Parameter(value, stderr, (value - 1.96 * stderr, value + 1.96 * stderr))
