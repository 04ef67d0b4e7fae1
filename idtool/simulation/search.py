"""Search for the parameter file whose simulated motion is the measured one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from idtool.fit.outcome import Outcome, outcome_of
from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.signals import Recording
from idtool.simulation.coordinates import (
    OF_DRIVE,
    Coordinate,
    Scales,
    coordinates_of,
    parameters_at,
    parameters_with_errors,
    start,
    with_values,
)
from idtool.simulation.plant import PlantFile
from idtool.simulation.stage import WINDOW_S, Stage, windows
from idtool.simulation.starts import SIDES

#: Half a step of the derivative: in logarithms and in typical sizes. Stick and slip make the motion jump in
#: a parameter, so a step as small as rounding allows would see nothing but jumps.
_STEP = 0.01
#: Evaluations of a first try and of the last one.
TRIED, MOST = 6, 40
#: A search to its end mostly takes no more than so many of them.
_USUAL = 16
#: Error beyond which a row counts less, over the median one.
_SOFT = 3.0
#: Share of the cost that what differs between the directions must take to be kept.
_WORTH = 0.1
#: A coordinate nearer its end than this makes nothing;
#: neither does what takes less than this share of the cost.
_NOTHING = 2e-3
#: Friction that gears take of the load.
_GEARS = "load_dependent_friction"
#: What simulates nothing is as wrong as so many times the way that the axis went.
_LOST = 3.0


@dataclass(frozen=True)
class Tried:
    parameters: Parameters
    coordinates: list[Coordinate]
    x: Array
    cost: float
    jacobian: Array
    residual: Array
    outcome: Outcome


class MotionSearch:
    """The logs, simulated again and again."""

    def __init__(self, logs: Sequence[Log], recording: Recording, measured: Array) -> None:
        self.recording, self.measured = recording, measured
        self.evaluations = 0
        blank = PlantFile.of(_blank(recording), recording.motion.torque_constant)
        self.logs, self.stages = logs, [Stage.of(logs, recording, blank, "effort")]
        motion = recording.motion
        parts = windows(motion.time, motion.starts.tolist(), WINDOW_S)
        self.window: NDArray[np.intp] = np.zeros(len(motion), dtype=np.intp)
        for number, part in enumerate(parts):
            self.window[part] = number
        self.way = float(np.ptp(measured))
        self.drive_was_off = not bool(np.all(self.stages[0].driven > 0.0))
        self.soft: list[float] = []
        self._worked = 0.0
        self._planned = 0.0
        self._progress: Callable[[float], None] | None = None

    def plan(self, most: Sequence[int], progress: Callable[[float], None] | None) -> None:
        """Fits to come, by their most evaluations, and what is called with the share done, 0 to 1."""
        self._planned, self._progress = self._worked + sum(min(one, _USUAL) for one in most), progress

    def _work(self, done: float) -> None:
        self._worked = done
        if self._progress is not None:
            self._progress(min(done / self._planned, 1.0))

    def coordinates(self, parameters: Parameters, scales: Scales) -> list[Coordinate]:
        """What these logs can tell of a file."""
        return coordinates_of(parameters, scales, drive_was_off=self.drive_was_off)

    def rms(self, parameters: Parameters) -> float:
        """Error of the position that the effort makes, rad (m)."""
        return math.sqrt(float(np.mean(self.errors(parameters)[0] ** 2)))

    def residual(self, parameters: Parameters) -> Array:
        """Errors over the size beyond which they count less, shape (ways to drive it * rows,)."""
        errors = self.errors(parameters)
        if not self.soft:
            self.soft = [max(_SOFT * float(np.median(np.abs(one))), 1e-4 * self.way) for one in errors]
        return np.concatenate([one / soft for one, soft in zip(errors, self.soft, strict=True)])

    def errors(self, parameters: Parameters) -> list[Array]:
        """Simulated less measured position, rad (m): from the effort, and from the goal."""
        self.evaluations += 1
        file = PlantFile.of(parameters, self.recording.motion.torque_constant)
        file = replace(file, coarse=True)
        most = _LOST * self.way
        every = [replace(one, file=file).run(WINDOW_S) - self.measured for one in self._stages(file)]
        return [np.asarray(np.clip(np.nan_to_num(off, nan=most), -most, most)) for off in every]

    def _stages(self, file: PlantFile) -> list[Stage]:
        """What is simulated: from the effort and, where the loop is known, from the goal too."""
        drive = file.parameters.drive
        # a torque that was measured needs no goal beside it
        known = drive is not None and drive.position_gain is not None
        if len(self.stages) == 1 and known and self.recording.by_voltage:
            self.stages.append(Stage.of(self.logs, self.recording, file, "goal"))
        return self.stages

    def fit(self, parameters: Parameters, coordinates: list[Coordinate], most: int) -> Tried:
        """Bounded least squares from a file, with at most so many evaluations of the Jacobian."""
        low = np.array([one.lower for one in coordinates])
        high = np.array([one.upper for one in coordinates])
        end = self._worked + min(most, _USUAL)

        def at(x: Array) -> Array:
            return self.residual(with_values(parameters, coordinates, parameters_at(coordinates, x)))

        def jacobian(x: Array) -> Array:
            columns = np.empty((len(self.measured) * len(self.stages), len(x)))
            for k in range(len(x)):
                above, below = x.copy(), x.copy()
                above[k], below[k] = min(x[k] + _STEP, high[k]), max(x[k] - _STEP, low[k])
                columns[:, k] = (at(above) - at(below)) / (above[k] - below[k])
            self._work(min(self._worked + 1.0, end))
            return columns

        result = optimize.least_squares(
            at,
            start(parameters, coordinates),
            jac=jacobian,
            bounds=(low, high),
            loss="soft_l1",
            x_scale=np.array([0.3 if one.logarithmic else 0.1 for one in coordinates]),
            max_nfev=most,
            ftol=1e-5,
            xtol=1e-5,
        )
        self._work(end)
        return Tried(
            with_values(parameters, coordinates, parameters_at(coordinates, result.x)),
            coordinates,
            result.x,
            float(result.cost),
            np.asarray(result.jac),
            result.fun,
            outcome_of(result),
        )

    def pruned(self, tried: Tried) -> Tried:
        """Without what the axis does not have: a bend, a dead band or a back-EMF of nothing, and friction
        under load that the motion is as near without."""
        places = zip(tried.coordinates, tried.x, strict=True)
        none = [one.name for one, x in places if one.name in OF_DRIVE and x - one.lower < _NOTHING]
        if none and tried.parameters.drive is not None:
            drive = replace(tried.parameters.drive, **dict.fromkeys(none))  # type: ignore[arg-type]
            kept = [one for one in tried.coordinates if one.name not in none]
            tried = self.fit(replace(tried.parameters, drive=drive), kept, TRIED)
        effects = tuple(one for one in tried.parameters.effects if one.name != _GEARS)
        if len(effects) == len(tried.parameters.effects):
            return tried
        kept = [one for one in tried.coordinates if one.part != _GEARS]
        less = self.fit(replace(tried.parameters, effects=effects), kept, TRIED)
        return less if less.cost < (1.0 + _NOTHING) * tried.cost else tried

    def without_sides(self, tried: Tried, scales: Scales) -> Tried:
        """Without what differs between the directions, where that hardly brings the motion closer."""
        effects = tuple(one for one in tried.parameters.effects if one.name not in dict(SIDES))
        less = replace(tried.parameters, effects=effects)
        other = self.fit(less, self.coordinates(less, scales), MOST)
        return other if other.cost < (1.0 + _WORTH) * tried.cost else tried

    def with_intervals(self, tried: Tried) -> Parameters:
        """The file with errors that hold for residuals correlated within a window."""
        jacobian, count = tried.jacobian, int(self.window[-1]) + 1
        bread = np.linalg.pinv(jacobian.T @ jacobian)
        # scipy scales the Jacobian by (1 + z)^-3/4 for this loss, whose gradient is J (1 + z)^-1/2 r
        pulled = tried.residual * (1.0 + tried.residual**2) ** 0.25
        scores = np.zeros((count, len(tried.x)))
        np.add.at(scores, np.tile(self.window, len(self.stages)), jacobian * pulled[:, None])
        free = max(count - len(tried.x), 1)
        covariance = bread @ (scores.T @ scores) @ bread * count / free
        quantile = float(special.stdtrit(free, 0.975))
        values = parameters_with_errors(tried.coordinates, tried.x, covariance, quantile)
        return with_values(tried.parameters, tried.coordinates, values)


def _blank(recording: Recording) -> Parameters:
    one = Parameter(1.0)
    static = dict.fromkeys(("coulomb", "static", "stribeck_velocity", "viscous"), one)
    return Parameters(axis=recording.axis, static=static, effects=(EffectEntry("inertia", {"inertia": one}),))
