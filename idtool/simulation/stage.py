"""Logs made ready to be simulated, whole or in windows, with a parameter file as the plant."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from idtool.fit.drive import gain_setting, goal_of
from idtool.log import Log, columns_of
from idtool.log.effort import Effort, effort_of, supply_of
from idtool.model import forward
from idtool.model.motion import Array
from idtool.model.units import is_linear
from idtool.signals import Recording
from idtool.simulation.plant import PlantFile

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
        file: the plant.
        given, scale, driven: see `forward.simulate`, shape (rows,).
        settings: gain setting of each log's servo, None where it is not told.
        by_goal: whether `given` is the goal.
    """

    recording: Recording
    file: PlantFile
    given: Array
    scale: Array
    driven: Array
    settings: tuple[float | None, ...]
    by_goal: bool

    @classmethod
    def of(cls, logs: Sequence[Log], recording: Recording, file: PlantFile, source: Source) -> Stage:
        """Gather what drives the plant."""
        efforts = [effort_of(log) for log in logs]
        motion, drive = recording.motion, file.parameters.drive
        driven = np.concatenate([_driven(log) for log in logs])
        scale = np.concatenate([_scale(log, effort) for log, effort in zip(logs, efforts, strict=True)])
        if source == "goal":
            assert drive is not None
            assert drive.delay is not None
            goal = np.concatenate([goal_of(log) for log in logs])
            given = _later(motion.time, goal, motion.first, drive.delay.value)
        else:
            back_emf = np.concatenate([effort.back_emf for effort in efforts])
            # the simulated speed takes the back-EMF off again
            given = (recording.torque + back_emf * motion.velocity) / scale
        settings = tuple(gain_setting(log) for log in logs)
        return cls(recording, file, given, scale, driven, settings, source == "goal")

    def run(self, seconds: float, progress: Callable[[float], None] = lambda _: None) -> Array:
        """Simulated position of every row; started anew from the measured state after so many seconds.

        Args:
            seconds: math.inf for whole trials.
            progress: called with the share done, 0 to 1.
        """
        motion, drive = self.recording.motion, self.file.parameters.drive
        path = np.empty(len(motion))
        top = float(np.max(np.abs(motion.velocity)))
        known: dict[tuple[float, ...], forward.Plant] = {}
        plant, current = None, -1
        for part in windows(motion.time, motion.starts.tolist(), seconds):
            trial = int(motion.trial[part.start])
            if trial != current or plant is None:
                whole = slice(int(motion.starts[trial]), int(motion.ends[trial]))
                gain = drive.gain_at(self.settings[self.recording.source[trial]]) if drive else 0.0
                emf = drive.back_emf.value if drive is not None and drive.back_emf is not None else None
                emf = self.file.parameters.axis.back_emf_damping if emf is None else emf
                around = self.file.surroundings(motion, whole)
                if around not in known:
                    known[around] = self.file.plant(motion, whole, emf)
                numbers = known[around].numbers.copy()
                numbers[forward.POSITION_GAIN] = gain
                plant = replace(known[around], numbers=numbers)
                added, current = self.file.added(motion, whole), trial
            velocity = float(motion.velocity[part.start])
            velocity = 0.0 if abs(velocity) < _AT_REST * top else velocity
            begin = float(motion.position[part.start])
            found = forward.simulate(
                plant,
                motion.time[part],
                self.given[part],
                self.scale[part],
                self.driven[part],
                added[part.start - whole.start : part.stop - whole.start],
                (begin, velocity, _bend(plant, velocity)),
                by_goal=self.by_goal,
            )[:, 0]
            path[part] = np.interp(motion.time[part] - self.file.delay, motion.time[part], found)
            progress(part.stop / len(motion))
        return path


def _bend(plant: forward.Plant, velocity: float) -> float:
    """Deflection of the bristle at a start: settled where the axis moves, none where it rests."""
    n = plant.numbers
    if n[forward.SIGMA0] == 0.0 or velocity == 0.0:
        return 0.0
    fade = math.exp(-min((abs(velocity) / n[forward.STRIBECK]) ** n[forward.EXPONENT], 700.0))
    level = n[forward.COULOMB] + (n[forward.STATIC] - n[forward.COULOMB]) * fade
    return math.copysign(float(level / n[forward.SIGMA0]), velocity)


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
        found += [slice(a, b) for a, b in pairwise(edges) if b - a > 1]
    return found


def _driven(log: Log) -> Array:
    on = log.column("drive_on")
    return np.ones(len(log.frame)) if on is None else np.asarray(on, dtype=float)


def _scale(log: Log, effort: Effort) -> Array:
    """Effort over what the loop commands."""
    voltage, duty = log.column("supply_voltage"), log.column("duty")
    if effort.column != columns_of(log.axis.kind)["duty"] or voltage is None or duty is None:
        return np.ones(len(log.frame))
    return np.asarray(supply_of(log, duty, voltage) * (log.axis.voltage_constant or 1.0), dtype=float)


def _later(time: Array, values: Array, first: NDArray[np.bool_], delay: float) -> Array:
    """The values as they act, `delay` after they were logged, trial by trial."""
    result = np.array(values, dtype=float)
    edges = [*np.flatnonzero(first).tolist(), len(time)]
    for begin, end in pairwise(edges):
        part = slice(begin, end)
        result[part] = np.interp(time[part] - delay, time[part], values[part])
    return result
