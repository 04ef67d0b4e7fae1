"""Search for the parameter file whose simulated motion is the measured one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from idtool.fit.chance import student_quantile
from idtool.fit.levenberg import minimise
from idtool.fit.outcome import Outcome
from idtool.log import Log
from idtool.model.forward import COARSE_STEP, LONGEST_STEP
from idtool.model.motion import Array
from idtool.parameters import Parameters
from idtool.parameters.drive import Drive
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

#: The furthest that one step of the search goes: of a logarithm, and in typical sizes. Further on an axis
#: that slid may stick, of which the derivatives know nothing.
_REACH, _REACH_PLAIN = 0.5, 0.2
#: A step that lowers the cost by a smaller share is the last. Where a number is its standard error away the
#: cost is higher by one over the windows, a hundredth.
_TOLERANCE = 1e-4
#: Step of a coordinate over which the plant (not the motion) is differentiated.
_STEP = 1e-6
#: Evaluations of a first try and of the last one.
TRIED, MOST = 6, 80
#: A search to its end mostly takes no more than so many of them.
_USUAL = 16
#: Error beyond which a row counts less, over the median one.
_SOFT = 3.0
#: Share of the cost that what differs between the directions must take to be kept.
_WORTH = 0.1
#: A coordinate nearer its end than this makes nothing.
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
    outcome: Outcome


class MotionSearch:
    """The logs, simulated again and again."""

    def __init__(
        self, logs: Sequence[Log], recording: Recording, measured: Array, drive: Drive | None
    ) -> None:
        self.recording, self.measured = recording, measured
        self.evaluations = 0
        self.longest_step = COARSE_STEP
        self.stages = [Stage.of(logs, recording), *self._goals(logs, drive)]
        motion = recording.motion
        parts = windows(motion.time, motion.starts.tolist(), WINDOW_S)
        self.window: NDArray[np.intp] = np.zeros(len(motion), dtype=np.intp)
        for number, part in enumerate(parts):
            self.window[part] = number
        self.windows = len(parts)
        self.way = float(np.ptp(measured))
        self.drive_was_off = not bool(np.all(self.stages[0].driven > 0.0))
        self.soft: Array | None = None
        self._worked = 0.0
        self._planned = 0.0
        self._progress: Callable[[float], None] | None = None

    def _goals(self, logs: Sequence[Log], drive: Drive | None) -> list[Stage]:
        """The goals as a way to drive it, beside the effort: a torque that was measured needs none."""
        if drive is None or drive.position_gain is None or not self.recording.by_voltage:
            return []
        return [Stage.of(logs, self.recording, drive)]

    def driven_by(self, drive: Drive | None, logs: Sequence[Log] = ()) -> MotionSearch:
        """The same search with another position loop, or none; it says nothing of how far it is."""
        other = copy(self)
        other._progress = None
        other.stages = [self.stages[0], *self._goals(logs, drive)]
        if self.soft is not None:
            other.soft = self.soft[: len(self.measured) * len(other.stages)]
        return other

    def goes_on_for(self, other: MotionSearch) -> None:
        """Say how far the search is, from where another one is."""
        self._worked, self._planned, self._progress = other._worked, other._planned, other._progress

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
        return math.sqrt(float(np.mean(self._errors([parameters])[0][: len(self.measured)] ** 2)))

    def _errors(self, files: Sequence[Parameters]) -> tuple[Array, Array]:
        """Simulated less measured position and its derivatives along coordinates.

        Args:
            files: what is simulated, then a file a step further on along each coordinate.

        Returns:
            From the effort and, behind it, from the goal: errors, rad (m), shape (ways to drive it * rows,),
            and their derivatives, shape (ways to drive it * rows, coordinates).
        """
        self.evaluations += 1
        file, *others = (self._plant(one) for one in files)
        rows, most = len(self.measured), _LOST * self.way
        off, along = np.empty(rows * len(self.stages)), np.empty((rows * len(self.stages), len(others)))
        for number, stage in enumerate(self.stages):
            part = slice(number * rows, (number + 1) * rows)
            path = stage.run_along(file, WINDOW_S, others, [_STEP] * len(others), along[part])
            off[part] = np.nan_to_num(path - self.measured, nan=most)
        lost = np.abs(off) >= most
        off[lost], along[lost] = np.clip(off[lost], -most, most), 0.0
        if others and not max(along.max(), -along.min()) * _REACH < most:  # not a number, or beyond all sense
            along[~(np.abs(along).max(axis=1) * _REACH < most)] = 0.0
        return off, along

    def _plant(self, parameters: Parameters) -> PlantFile:
        file = PlantFile.of(parameters, self.recording.motion.torque_constant)
        return replace(file, longest_step=self.longest_step)

    def residual(
        self, parameters: Parameters, coordinates: Sequence[Coordinate], x: Array
    ) -> tuple[Array, Array]:
        """What squares to the soft loss of the errors, and its derivatives.

        Args:
            parameters, coordinates: a file, and what of it is varied.
            x: a point or, as `_stepped` makes them, with one a step further on along each coordinate behind
                it, shape (1 or 1 + coordinates, coordinates).

        Returns:
            Shapes of `_errors`; derivatives along no coordinate where there is nothing behind the point.
        """
        off, along = self._errors(
            [with_values(parameters, coordinates, parameters_at(coordinates, one)) for one in x]
        )
        if self.soft is None:
            each = np.median(np.abs(off.reshape(len(self.stages), -1)), axis=1)
            self.soft = np.repeat(np.maximum(_SOFT * each, 1e-4 * self.way), len(self.measured))
        off /= self.soft
        along *= (_soft_slope(off) / self.soft)[:, None]
        return _soft(off), along

    def fit(self, parameters: Parameters, coordinates: list[Coordinate], most: int) -> Tried:
        """Bounded least squares from a file, with at most so many evaluations."""
        end = self._worked + min(most, _USUAL)

        def jacobian(x: Array) -> Array:
            self._work(min(self._worked + 1.0, end))
            return self.residual(parameters, coordinates, _stepped(x))[1]

        found = minimise(
            lambda x: self.residual(parameters, coordinates, x[None])[0],
            jacobian,
            start(parameters, coordinates),
            np.array([one.lower for one in coordinates]),
            np.array([one.upper for one in coordinates]),
            most=most,
            tolerance=_TOLERANCE,
            reach=np.array([_REACH if one.logarithmic else _REACH_PLAIN for one in coordinates]),
            secant=True,
        )
        self._work(end)
        fitted = with_values(parameters, coordinates, parameters_at(coordinates, found.x))
        return Tried(fitted, coordinates, found.x, 0.5 * found.cost, found.outcome)

    def apart(self, tries: Sequence[Tried]) -> list[Tried]:
        """The nearest first, without those that noise does not tell from one before."""
        found: list[Tried] = []
        for one in sorted(tries, key=lambda one: one.cost):
            if not found or self.is_worse(one, found[-1]):
                found.append(one)
        return found

    def is_worse(self, one: Tried, than: Tried) -> bool:
        """Whether by more than noise makes of one number: errors within a window hang together, so that the
        windows are what was drawn."""
        return one.cost > (1.0 + 1.0 / self.windows) * than.cost

    def pruned(self, tried: Tried) -> Tried:
        """Without what the axis does not have: a bend, a dead band or a back-EMF of nothing, and friction
        under load that the motion is as near without."""
        places = zip(tried.coordinates, tried.x, strict=True)
        none = [one.name for one, x in places if one.name in OF_DRIVE and x - one.lower < _NOTHING]
        if none and tried.parameters.drive is not None:
            drive = replace(tried.parameters.drive, **dict.fromkeys(none))  # type: ignore[arg-type]
            kept = [one for one in tried.coordinates if one.name not in none]
            tried = self.fit(replace(tried.parameters, drive=drive), kept, MOST)
        effects = tuple(one for one in tried.parameters.effects if one.name != _GEARS)
        if len(effects) == len(tried.parameters.effects):
            return tried
        kept = [one for one in tried.coordinates if one.part != _GEARS]
        less = self.fit(replace(tried.parameters, effects=effects), kept, TRIED)
        return tried if self.is_worse(less, tried) else less

    def without_sides(self, tried: Tried, scales: Scales) -> Tried:
        """Without what differs between the directions, where that hardly brings the motion closer."""
        effects = tuple(one for one in tried.parameters.effects if one.name not in dict(SIDES))
        less = replace(tried.parameters, effects=effects)
        other = self.fit(less, self.coordinates(less, scales), MOST)
        return other if other.cost < (1.0 + _WORTH) * tried.cost else tried

    def finished(self, tried: Tried) -> Tried:
        """Fitted in the steps that `idtool.verbs.simulate` takes."""
        self.longest_step = LONGEST_STEP
        return self.fit(tried.parameters, tried.coordinates, MOST)

    def with_intervals(self, tried: Tried) -> Parameters:
        """The file with errors that hold for residuals correlated within a window."""
        count = self.windows
        residual, jacobian = self.residual(tried.parameters, tried.coordinates, _stepped(tried.x))
        curved = jacobian * _curvature(residual)[:, None]
        bread = np.linalg.pinv(curved.T @ curved)
        scores = np.zeros((count, len(tried.x)))
        pulls = jacobian * residual[:, None]
        np.add.at(scores, np.tile(self.window, len(self.stages)), pulls)
        free = max(count - len(tried.x), 1)
        covariance = bread @ (scores.T @ scores) @ bread * count / free
        quantile = float(student_quantile(np.array([free]), 0.975)[0])
        values = parameters_with_errors(tried.coordinates, tried.x, covariance, quantile)
        return with_values(tried.parameters, tried.coordinates, values)


def _stepped(x: Array) -> Array:
    """A point, and one a step further on along each coordinate; shape (1 + coordinates, coordinates)."""
    return np.vstack([x, x + _STEP * np.eye(len(x))])


def _soft(residual: Array) -> Array:
    """What squares to the soft loss 2 (sqrt(1 + r^2) - 1): large errors count by their size alone."""
    return np.asarray(residual * np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + residual**2))))


def _soft_slope(residual: Array) -> Array:
    """Derivative of `_soft`."""
    root = np.sqrt(1.0 + residual**2)
    return np.asarray(np.sqrt(0.5 * (1.0 + root)) / root)


def _curvature(soft: Array) -> Array:
    """Root of the second derivative of half the loss, over the derivative of `_soft`, where that is `soft`: a
    row far off says little of how well a number is known."""
    root = 1.0 + 0.5 * soft**2
    return np.asarray(np.sqrt(2.0 / (root * (1.0 + root))))
