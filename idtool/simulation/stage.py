"""Logs made ready to be simulated, whole or in windows, with a parameter file as the plant."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from idtool.fit.drive import gain_setting, goal_of
from idtool.log import Log, columns_of
from idtool.log.effort import Effort, effort_of, supply_of
from idtool.model import forward, tabulated
from idtool.model.motion import Array
from idtool.model.stribeck import level
from idtool.model.units import is_linear
from idtool.parameters.drive import Drive
from idtool.signals import Recording
from idtool.simulation.plant import PlantFile, Surroundings

Source = Literal["effort", "goal"]
#: MuJoCo's own identification judges a model over windows of one second, each from the measured state.
WINDOW_S = 1.0
#: Slower than this share of the top speed a trial starts from rest.
_AT_REST = 0.01


@dataclass(frozen=True)
class Stage:
    """Logs made ready to be simulated again and again.

    Attributes:
        recording: the logs.
        given, scale, driven: see `forward.simulate`, shape (rows,).
        settings: gain setting of each log's servo, None where it is not told.
        by_goal: whether `given` is the goal.
    """

    recording: Recording
    given: Array
    scale: Array
    driven: Array
    settings: tuple[float | None, ...]
    by_goal: bool

    @classmethod
    def of(cls, logs: Sequence[Log], recording: Recording, drive: Drive | None = None) -> Stage:
        """Gather what drives the plant: the goals through a position loop if given, else the efforts."""
        efforts = [effort_of(log) for log in logs]
        motion = recording.motion
        driven = np.concatenate([_driven(log) for log in logs])
        scale = np.concatenate([_scale(log, effort) for log, effort in zip(logs, efforts, strict=True)])
        if drive is not None:
            assert drive.delay is not None
            goal = np.concatenate([goal_of(log) for log in logs])
            given = later(motion.time, goal, motion.first, drive.delay.value)
        else:
            given = recording.torque / scale
        settings = tuple(gain_setting(log) for log in logs)
        return cls(recording, given, scale, driven, settings, drive is not None)

    def run(
        self, file: PlantFile, seconds: float, progress: Callable[[float], None] = lambda _: None
    ) -> Array:
        """Simulated position of every row; started anew from the measured state after so many seconds.

        Args:
            file: the plant.
            seconds: math.inf for whole trials.
            progress: called with the share done, 0 to 1.

        Returns:
            Position, rad (m), shape (rows,).
        """
        nothing = np.empty((len(self.recording.motion), 0))
        return self.run_along(file, seconds, (), (), nothing, progress)

    def run_along(
        self,
        file: PlantFile,
        seconds: float,
        others: Sequence[PlantFile],
        steps: Sequence[float],
        along: Array,
        progress: Callable[[float], None] = lambda _: None,
    ) -> Array:
        """As `run`, with derivatives of the position along coordinates.

        Args:
            file, seconds, progress: see `run`.
            others: the plant a small step further on along each coordinate.
            steps: sizes of these steps.
            along: where the derivatives go, shape (rows, coordinates).

        Returns:
            Position, rad (m), shape (rows,).
        """
        motion = self.recording.motion
        path = np.empty(len(motion))
        given, driven = self._in_step(file.delay)
        known: dict[tuple[float, ...], tuple[tabulated.Plant, tabulated.Slopes]] = {}
        for trial, begins in enumerate(self._begins(seconds)):
            rows = slice(int(motion.starts[trial]), int(motion.ends[trial]))
            key = file.surroundings(motion, rows)
            if key not in known:
                known[key] = self._plant(file, others, steps, key, rows)
            plant, slopes = known[key]
            drive, numbers = file.parameters.drive, plant.numbers.copy()
            setting = self.settings[self.recording.source[trial]]
            numbers[tabulated.POSITION_GAIN] = drive.gain_at(setting) if drive is not None else 0.0
            plant = replace(plant, numbers=numbers)
            path[rows] = forward.simulate(
                plant,
                motion.time[rows],
                given[rows],
                self.scale[rows],
                driven[rows],
                file.added(motion, rows),
                begins - rows.start,
                self._start(plant, begins),
                by_goal=self.by_goal,
                slopes=slopes,
                along=along[rows],
            )[:, 0]
            progress(rows.stop / len(motion))
        return path

    def _in_step(self, delay: float) -> tuple[Array, Array]:
        """`given` and `driven` as late as the motion is read, so that a window that starts from what was read
        is driven by what acted then."""
        if delay == 0.0:
            return self.given, self.driven
        if delay not in self._known_steps:
            time, first = self.recording.motion.time, self.recording.motion.first
            self._known_steps.clear()
            self._known_steps[delay] = (
                later(time, self.given, first, delay),
                np.round(later(time, self.driven, first, delay)),
            )
        return self._known_steps[delay]

    @cached_property
    def _known_steps(self) -> dict[float, tuple[Array, Array]]:
        return {}

    def _begins(self, seconds: float) -> list[NDArray[np.intp]]:
        """First rows of the windows of every trial."""
        if seconds not in self._known_begins:
            motion = self.recording.motion
            first = np.array([part.start for part in windows(motion.time, motion.starts.tolist(), seconds)])
            self._known_begins[seconds] = np.split(first, np.searchsorted(first, motion.starts[1:]))
        return self._known_begins[seconds]

    @cached_property
    def _known_begins(self) -> dict[float, list[NDArray[np.intp]]]:
        return {}

    @cached_property
    def _surroundings(self) -> dict[tuple[float, ...], Surroundings]:
        return {}

    def _plant(
        self,
        file: PlantFile,
        others: Sequence[PlantFile],
        steps: Sequence[float],
        key: tuple[float, ...],
        rows: slice,
    ) -> tuple[tabulated.Plant, tabulated.Slopes]:
        if key not in self._surroundings:
            self._surroundings[key] = file.around(self.recording.motion, rows)
        around = self._surroundings[key]
        plant = file.plant(around)
        further = [other.plant(around, (file, plant)) for other in others]
        return plant, tabulated.Slopes.between(plant, further, steps)

    def _start(self, plant: tabulated.Plant, begins: NDArray[np.intp]) -> Array:
        """Measured position and velocity at the start of each window, and the deflection of the bristle:
        settled where the axis moves, none where it rests; shape (windows, 3)."""
        motion, n = self.recording.motion, plant.numbers
        velocity = motion.velocity[begins]
        velocity = np.where(np.abs(velocity) < _AT_REST * self._top, 0.0, velocity)
        bend = np.zeros(len(begins))
        if n[tabulated.SIGMA0] > 0.0:
            curve = level(
                np.abs(velocity),
                n[tabulated.COULOMB],
                n[tabulated.STATIC],
                n[tabulated.STRIBECK],
                n[tabulated.EXPONENT],
            )
            bend = np.sign(velocity) * curve / n[tabulated.SIGMA0]
        return np.column_stack([motion.position[begins], velocity, bend])

    @cached_property
    def _top(self) -> float:
        return float(np.max(np.abs(self.recording.motion.velocity)))


def measured_position(logs: Sequence[Log], recording: Recording) -> Array:
    """The position as it was read, whole turns put right; the integrated speed where none was read."""
    smooth = recording.motion.position
    read = [one for log in logs if (one := log.column("position")) is not None]
    if len(read) < len(logs):
        return smooth
    raw = np.concatenate(read)
    if is_linear(recording.axis.units):
        return np.asarray(raw, dtype=float)
    return np.asarray(raw + 2.0 * math.pi * np.round((smooth - raw) / (2.0 * math.pi)), dtype=float)


def windows(time: Array, starts: Sequence[int], seconds: float) -> list[slice]:
    """Stretches of so many seconds of every trial, the last of each shorter."""
    found = []
    ends = [*starts[1:], len(time)]
    for begin, end in zip(starts, ends, strict=True):
        marks = np.arange(time[begin], time[end - 1], seconds) if np.isfinite(seconds) else [time[begin]]
        edges = [begin + int(k) for k in np.searchsorted(time[begin:end], marks)] + [end]
        found += [slice(a, b) for a, b in pairwise(edges) if b > a]
    return found


def _driven(log: Log) -> Array:
    on = log.column("drive_on")
    return np.ones(log.row_count) if on is None else np.asarray(on, dtype=float)


def _scale(log: Log, effort: Effort) -> Array:
    """Effort over what the loop commands."""
    voltage, duty = log.column("supply_voltage"), log.column("duty")
    if effort.column != columns_of(log.axis.kind)["duty"] or voltage is None or duty is None:
        return np.ones(log.row_count)
    return np.asarray(supply_of(log, duty, voltage) * (log.axis.voltage_constant or 1.0), dtype=float)


def later(time: Array, values: Array, first: NDArray[np.bool_], delay: float) -> Array:
    """The values as they were `delay` before each row, trial by trial."""
    result = np.array(values, dtype=float)
    edges = [*np.flatnonzero(first).tolist(), len(time)]
    for begin, end in pairwise(edges):
        part = slice(begin, end)
        result[part] = np.interp(time[part] - delay, time[part], values[part])
    return result
