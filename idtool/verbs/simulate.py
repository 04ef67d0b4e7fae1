"""Simulate logs forward with a parameter file: the position that the logged effort, or the goal, makes.

    simulation = simulate(logs, Parameters.read("params.toml"))
    simulation.frame            # trial, time_s, position_rad, position_simulated_rad
    simulation.mean_abs         # rad, over all rows

From the effort the identified axis alone is judged; small errors of the torque add up over a trial. From the
goal the servo's own loop (`[drive]`) closes around the axis, as it does on the machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.fit.drive import fit_drive, gain_setting
from idtool.log import Log, columns_of
from idtool.log.effort import Effort, effort_of, supply_of
from idtool.model import forward
from idtool.model.motion import Array
from idtool.model.units import is_linear
from idtool.parameters import Parameters
from idtool.parameters.drive import with_loop
from idtool.signals import Recording, record
from idtool.signals.lateness import without_late_velocity
from idtool.verbs.plant import PlantFile, windows
from idtool.verbs.predict import of_axis

Source = Literal["effort", "goal"]
#: MuJoCo's own identification judges a model over windows of one second, each from the measured state.
WINDOW_S = 1.0
#: Slower than this share of the top speed a trial starts from rest.
_AT_REST = 0.01


@dataclass(frozen=True)
class TrialError:
    """How far one trial's simulated position is off, rad (m).

    Attributes:
        log: file.
        trial: its number there.
        mean_abs, rms: over the trial, simulated from its first row alone.
        rms_windows: rms over windows of one second, each started from the measured state.
    """

    log: str
    trial: int
    mean_abs: float
    rms: float
    rms_windows: float


@dataclass(frozen=True)
class Simulation:
    """Simulated logs.

    Attributes:
        frame: trial, time_s, position measured and simulated (file column names).
        trials: the error of each trial.
        mean_abs, rms, rms_windows: over all rows, see `TrialError`.
        seconds: of motion that were simulated.
        notes: sentences on what was left out or taken from these logs.
        linear: whether positions are metres.
    """

    frame: pd.DataFrame
    trials: tuple[TrialError, ...]
    mean_abs: float
    rms: float
    rms_windows: float
    seconds: float
    notes: tuple[str, ...]
    linear: bool

    def to_document(self) -> dict[str, Any]:
        """What `--json` prints: errors in mrad (mm on a linear axis)."""
        unit = "mm" if self.linear else "mrad"

        def errors(one: Simulation | TrialError) -> dict[str, float]:
            return {
                f"mean_abs_{unit}": 1e3 * one.mean_abs,
                f"rms_{unit}": 1e3 * one.rms,
                f"rms_1s_windows_{unit}": 1e3 * one.rms_windows,
            }

        trials = [{"log": one.log, "trial": one.trial, **errors(one)} for one in self.trials]
        return {**errors(self), "trials": trials, "seconds": self.seconds, "notes": list(self.notes)}


def simulate(log: Log | Sequence[Log], parameters: Parameters, source: Source = "effort") -> Simulation:
    """Simulate one log or several.

    Args:
        log: of the axis that the file describes.
        parameters: the file; it needs inertia and static friction.
        source: "effort", or "goal" for the logged goal through the position loop of `[drive]`, which is
            identified from these logs where the file has none.

    Raises:
        InputError: logs of another axis, no inertia, or no goal in a log.
    """
    logs, notes = without_late_velocity(of_axis([log] if isinstance(log, Log) else log, parameters))
    recording = record(logs, every_row=True)
    if source == "goal":
        _require_goal(logs)
        if parameters.drive is None or parameters.drive.position_gain is None:
            parameters = replace(parameters, drive=with_loop(parameters.drive, fit_drive(logs)))
            notes.append(
                "the parameter file has no [drive]: the position loop was identified from these logs."
            )
    file = PlantFile.of(parameters, recording.motion.torque_constant)
    stage = Stage.of(logs, recording, file, source)
    path = stage.run(math.inf)
    again = stage.run(WINDOW_S)
    measured = measured_position(logs, recording)
    off, off_again = path - measured, again - measured
    motion = recording.motion
    trials = []
    for trial, source_index in enumerate(recording.source):
        rows = motion.trial == trial
        numbers = logs[source_index].frame["trial"].to_numpy()
        before = sum(len(one.frame) for one in logs[:source_index])
        trials.append(
            TrialError(
                logs[source_index].source,
                int(numbers[int(np.argmax(rows)) - before]),
                float(np.mean(np.abs(off[rows]))),
                _rms(off[rows]),
                _rms(off_again[rows]),
            )
        )
    position = columns_of(recording.axis.kind)["position"]
    name, _, unit = position.rpartition("_")
    number = logs[0].frame["trial"].to_numpy() if len(logs) == 1 else motion.trial
    frame = pd.DataFrame(
        {"trial": number, "time_s": motion.time, position: measured, f"{name}_simulated_{unit}": path}
    )
    return Simulation(
        frame,
        tuple(trials),
        float(np.mean(np.abs(off))),
        _rms(off),
        _rms(off_again),
        float(motion.step.sum()),
        (*notes, *file.notes, *recording.remarks),
        is_linear(recording.axis.units),
    )


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
            goal = np.concatenate([log.column("position_command") for log in logs])
            given = _later(motion.time, goal, motion.first, drive.delay.value)
        else:
            back_emf = np.concatenate([effort.back_emf for effort in efforts])
            # the simulated speed takes the back-EMF off again
            given = (recording.torque + back_emf * motion.velocity) / scale
        settings = tuple(gain_setting(log) for log in logs)
        return cls(recording, file, given, scale, driven, settings, source == "goal")

    def run(self, seconds: float) -> Array:
        """Simulated position of every row; started anew from the measured state after so many seconds."""
        motion, drive = self.recording.motion, self.file.parameters.drive
        path = np.empty(len(motion))
        top = float(np.max(np.abs(motion.velocity)))
        ends = np.append(motion.starts[1:], len(motion))
        known: dict[tuple[float, ...], forward.Plant] = {}
        plant, current = None, -1
        for part in windows(motion.time, motion.starts.tolist(), seconds):
            trial = int(motion.trial[part.start])
            if trial != current or plant is None:
                whole = slice(int(motion.starts[trial]), int(ends[trial]))
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


def _require_goal(logs: Sequence[Log]) -> None:
    for log in logs:
        if log.column("position_command") is None:
            name = columns_of(log.axis.kind)["position_command"]
            raise InputError(
                f'has no column "{name}", the goal of the servo\'s position loop',
                file=log.source,
                remedy="log it, or simulate with --from effort",
            )


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


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
