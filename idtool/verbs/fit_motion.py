"""Fit a parameter file to the motion itself: the position that the logged effort makes, not the torque.

A servo that reports duty and no current tells its torque badly: what bends the line from duty to torque, the
friction that its gears take of a load, and rows at rest under a changing duty all look alike there, row by
row. The motion tells them apart. The logs are simulated over windows of one second, each from the
measured state (Bock's multiple shooting with the states that were measured, and what MuJoCo's own
identification does), and bounded least squares with a soft loss bring the simulated position to the measured
one. Windows, since over a whole trial one slip at a wrong moment outweighs all the rest.

Source: Bock, "Recent advances in parameter identification techniques for ODE", 1983; for friction under load
Duclusaud et al. 2025 (BAM, model M4).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from idtool.errors import InputError
from idtool.fit.choose import choose_gravity
from idtool.fit.drive import fit_drive
from idtool.fit.outcome import Outcome, outcome_of
from idtool.log import Log
from idtool.model import gravity
from idtool.model.motion import Array
from idtool.parameters import GRAVITY_MODELS, EffectEntry, Parameter, Parameters
from idtool.parameters.drive import Drive, with_loop
from idtool.signals import Recording, record
from idtool.signals.lateness import without_late_velocity
from idtool.verbs.motion_coordinates import (
    Coordinate,
    Scales,
    coordinates_of,
    parameters_at,
    parameters_with_errors,
    start,
    with_values,
)
from idtool.verbs.plant import PlantFile, windows
from idtool.verbs.simulate import WINDOW_S, Stage, measured_position

#: Half a step of the derivative: in logarithms and in typical sizes. Stick and slip make the motion jump in
#: a parameter, so a step as small as rounding allows would see nothing but jumps.
_STEP = 0.01
#: Evaluations of a first try and of the last one.
_TRIED, _MOST = 6, 40
#: Error beyond which a row counts less, over the median one.
_SOFT = 3.0
#: Of the tries so many are followed to their end.
_FOLLOWED = 2
#: Effects that differ between the directions, and the share of the cost that they must take to be kept.
_SIDES = (("torque_offset", "offset"), ("direction_asymmetry", "asymmetry"))
_WORTH = 0.1
#: An axis that swings over more may be a pendulum, rad.
_LEAST_SWING = 0.3
#: What simulates nothing is as wrong as so many times the way that the axis went.
_LOST = 3.0


@dataclass(frozen=True)
class MotionFit:
    """A file fitted to the motion.

    Attributes:
        parameters: the file.
        before, after: rms error over windows of one second from the effort, rad (m); `before` is that of the
            start.
        evaluations: how often the logs were simulated.
        outcome: how the last fit ended.
        notes: sentences that qualify it.
    """

    parameters: Parameters
    before: float
    after: float
    evaluations: int
    outcome: Outcome
    notes: tuple[str, ...]


def fit_motion(
    logs: Sequence[Log],
    known: Parameters | None = None,
    *,
    tell: Callable[[str], None] = lambda _: None,
) -> MotionFit:
    """Fit.

    Args:
        logs: of one axis, with its position (or speed).
        known: a file to start from, whose gravity model, friction law and effects are kept; a regression
            on the moving rows if None.
        tell: called with a sentence on what is going on.

    Raises:
        InputError: logs that cannot be used, or a file without inertia or friction.
    """
    logs, notes = without_late_velocity(logs)
    recording = record(logs, every_row=True)
    measured = measured_position(logs, recording)
    first = regress(recording) if known is None else known
    if known is not None and not known.static:
        raise InputError(
            "the parameter file has no [friction.static]",
            remedy="make it with ffc-id identify, or leave it out: a regression starts the fit then",
        )
    first = _without_bristle(_with_drive(first, logs))
    scales = _scales(recording)
    starts = [first, *_of_a_gearbox(first, recording, scales)]
    problem = _Problem(logs, recording, measured)
    tell("fitting the motion")
    before = problem.rms(first)
    tries = [problem.fit(one, coordinates_of(one, scales), _TRIED) for one in starts]
    nearest = sorted(tries, key=lambda one: one.cost)[:_FOLLOWED]
    ends = [problem.fit(one.parameters, one.coordinates, _MOST) for one in nearest]
    best = problem.pruned(min(ends, key=lambda one: one.cost))
    if known is None:
        best = problem.without_sides(best, scales)
    after = problem.rms(best.parameters)
    ended = best.outcome
    failed = () if ended.converged else (f"{ended.value}: {ended.meaning}; {ended.advice}.",)
    fitted = problem.with_intervals(best)
    return MotionFit(
        replace(fitted, provenance={**fitted.provenance, "fit_motion": ended.value}),
        before,
        after,
        problem.evaluations,
        ended,
        (*notes, *failed, *PlantFile.of(best.parameters, recording.motion.torque_constant).notes),
    )


def regress(recording: Recording) -> Parameters:
    """Gravity, inertia, Coulomb and viscous friction by linear regression on the moving rows."""
    motion = recording.motion
    model, names = choose_gravity(recording, "auto")
    if model is None and recording.axis.kind == "rotary" and np.ptp(motion.position) >= _LEAST_SWING:
        model, names = choose_gravity(
            recording, "arm"
        )  # too little for a test of the torque, not of the motion
    columns = [np.sign(motion.velocity), motion.velocity, motion.acceleration]
    known = tuple(GRAVITY_MODELS[model]) if model else ()
    pull = gravity.columns(model, motion) if model else np.zeros((len(motion), 0))
    pull = pull[:, [known.index(name) for name in names]]
    regressors = recording.filtered(np.column_stack([*columns, pull]))
    target = recording.filtered(recording.torque)
    found = np.linalg.lstsq(regressors, target, rcond=1e-10)[0]
    scales = _scales(recording)
    coulomb = max(float(found[0]), 0.01 * scales.torque)
    told = dict(zip(names, found[3:].tolist(), strict=True))
    return Parameters(
        axis=recording.axis,
        gravity_model=model,
        gravity={name: Parameter(told.get(name, 0.0)) for name in known},
        static={
            "coulomb": Parameter(coulomb),
            "static": Parameter(coulomb),
            "stribeck_velocity": Parameter(0.1 * scales.velocity),
            "viscous": Parameter(max(float(found[1]), 0.01 * scales.of("damping"))),
        },
        effects=(
            EffectEntry("inertia", {"inertia": Parameter(max(float(found[2]), 0.01 * scales.of("inertia")))}),
            *(EffectEntry(effect, {name: Parameter(0.0)}) for effect, name in _SIDES),
        ),
    )


def _scales(recording: Recording) -> Scales:
    motion = recording.motion
    return Scales(
        float(np.sqrt(np.mean(recording.torque**2))),
        max(float(np.quantile(np.abs(motion.velocity), 0.98)), 1e-9),
        max(float(np.ptp(motion.position)), 1e-9),
    )


def _with_drive(parameters: Parameters, logs: Sequence[Log]) -> Parameters:
    """The file with the position loop where the logs have a goal."""
    if any(log.column("position_command") is None for log in logs):
        return parameters
    try:
        return replace(parameters, drive=with_loop(parameters.drive, fit_drive(logs)))
    except InputError:  # the goal is not what drives the motor
        return parameters


def _without_bristle(parameters: Parameters) -> Parameters:
    """Over a window of a second presliding shows in little but its damping; that is kept if it is sure."""
    known = parameters.dynamic
    sure = known and all(one.identified and not one.at_bound for one in known.values())
    return parameters if sure else replace(parameters, dynamic={})


def _of_a_gearbox(first: Parameters, recording: Recording, scales: Scales) -> list[Parameters]:
    """Starts with what a servo has between duty and motion: friction that its gears take of the load, a
    line from duty to torque that bends, back-EMF that is gone where the drive is off."""
    plain = first
    if recording.by_voltage:
        drive = first.drive or Drive("duty")
        drive = replace(
            drive,
            bend=drive.bend or Parameter(0.05),
            dead_band=drive.dead_band or Parameter(0.005),
            back_emf=drive.back_emf or Parameter(0.5 * first.static["viscous"].value),
        )
        plain = replace(first, drive=drive)
    if first.gravity_model is None:
        return [plain] if recording.by_voltage else []
    load = max(math.hypot(*(one.value for one in first.gravity.values())), 0.1 * scales.torque)
    found = []
    for share, bend in ((0.3, 0.3), (0.1, 0.1)):
        friction = 0.02 * load
        static = {
            **first.static,
            "coulomb": Parameter(friction),
            "static": Parameter(friction),
            "stribeck_velocity": Parameter(0.2 * scales.velocity),
        }
        entry = {"mu": Parameter(0.1), "doubling_load": Parameter(friction / share)}
        start_here = replace(plain, static=static)
        if plain.drive is not None and plain.drive.bend is not None:
            start_here = replace(start_here, drive=replace(plain.drive, bend=Parameter(bend)))
        found.append(start_here.with_effect(EffectEntry("load_dependent_friction", entry)))
    return found


@dataclass(frozen=True)
class _Tried:
    parameters: Parameters
    coordinates: list[Coordinate]
    x: Array
    cost: float
    jacobian: Array
    residual: Array
    outcome: Outcome


class _Problem:
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
        self.soft: list[float] = []

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

    def fit(self, parameters: Parameters, coordinates: list[Coordinate], most: int) -> _Tried:
        """Bounded least squares from a file, with at most so many evaluations of the Jacobian."""
        low = np.array([one.lower for one in coordinates])
        high = np.array([one.upper for one in coordinates])

        def at(x: Array) -> Array:
            return self.residual(with_values(parameters, coordinates, parameters_at(coordinates, x)))

        def jacobian(x: Array) -> Array:
            columns = np.empty((len(self.measured) * len(self.stages), len(x)))
            for k in range(len(x)):
                above, below = x.copy(), x.copy()
                above[k], below[k] = min(x[k] + _STEP, high[k]), max(x[k] - _STEP, low[k])
                columns[:, k] = (at(above) - at(below)) / (above[k] - below[k])
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
        return _Tried(
            with_values(parameters, coordinates, parameters_at(coordinates, result.x)),
            coordinates,
            result.x,
            float(result.cost),
            np.asarray(result.jac),
            result.fun,
            outcome_of(result),
        )

    def pruned(self, tried: _Tried) -> _Tried:
        """Without what the drive does not have: a bend, a dead band or a back-EMF of nothing."""
        drive = tried.parameters.drive
        if drive is None:
            return tried
        ends = {one.name: x - one.lower for one, x in zip(tried.coordinates, tried.x, strict=True)}
        none = [name for name in ("bend", "dead_band", "back_emf") if ends.get(name, 1.0) < 2e-3]
        if not none:
            return tried
        drive = replace(drive, **dict.fromkeys(none))  # type: ignore[arg-type]
        kept = [one for one in tried.coordinates if one.name not in none]
        return self.fit(replace(tried.parameters, drive=drive), kept, _TRIED)

    def without_sides(self, tried: _Tried, scales: Scales) -> _Tried:
        """Without what differs between the directions, where that hardly brings the motion closer."""
        effects = tuple(one for one in tried.parameters.effects if one.name not in dict(_SIDES))
        less = replace(tried.parameters, effects=effects)
        other = self.fit(less, coordinates_of(less, scales), _MOST)
        return other if other.cost < (1.0 + _WORTH) * tried.cost else tried

    def with_intervals(self, tried: _Tried) -> Parameters:
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
