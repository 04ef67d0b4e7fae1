"""The fits one by one: gravity, static friction, dynamic friction.

Each works on the logs that it is given and holds what the parameter file already has. Each fits the
whole model, because a bristle that has not settled bends a static curve and friction hides gravity; it
hands back only its own part.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from idtool.effects import registry
from idtool.errors import InputError
from idtool.fit.choose import bending_fits, choose_gravity, first_fit
from idtool.fit.joint import JointFit, refit, solve
from idtool.fit.levenberg import minimise
from idtool.fit.model import LOGARITHMIC, JointModel
from idtool.fit.next_sweep import LEAST_SPEEDS, run_command
from idtool.fit.outcome import Outcome
from idtool.fit.search import cost_over_stiffness, search
from idtool.fit.spec import Spec
from idtool.fit.windows import Window, steady_windows
from idtool.model import gravity as gravity_model
from idtool.model.motion import Array
from idtool.model.stribeck import steady, steady_slopes
from idtool.parameters import GRAVITY_MODELS, Parameter, Parameters
from idtool.presentation.text import counted
from idtool.signals import Recording
from idtool.signals.thin import thin

#: Half width of a 95 % limit on one side, standard errors.
_ONE_SIDED = 1.645
#: Evaluations of the fit of four numbers through the windows.
_CURVE_MOST = 400


@dataclass(frozen=True)
class GravityPoint:
    """Gravity torque at one payload (slide) or position (arm), friction removed."""

    payload: float | None
    position: float | None
    torque: float
    model: float
    stderr: float


@dataclass(frozen=True)
class GravityFit:
    """Outcome of `fit_gravity`. `average_error` is in per cent, as the paper states it."""

    fit: JointFit
    points: list[GravityPoint]
    average_error: float


@dataclass(frozen=True)
class StaticFit:
    """What `fit_static` found: windows, the curve through them, how its fit ended, and its adjusted R2.

    Where that fit did not converge the curve is the joint fit's.
    """

    fit: JointFit
    windows: list[Window]
    curve: dict[str, float]
    curve_outcome: Outcome
    adjusted_r2: float


@dataclass(frozen=True)
class DynamicFit:
    """Outcome of `fit_dynamic`: the fit, and the cost over sigma0, computed when asked for."""

    fit: JointFit

    @property
    def stiffness(self) -> Array:
        """Bristle stiffnesses over the range that was searched."""
        return self._over_stiffness[0]

    @property
    def cost(self) -> Array:
        """Root-mean-square residual at each of them, the static parameters held."""
        return self._over_stiffness[1]

    @cached_property
    def _over_stiffness(self) -> tuple[Array, Array]:
        curve = {name: self.fit.values[name] for name in ("coulomb", "static", "stribeck_velocity")}
        return cost_over_stiffness(self.fit.model, curve)


def fit_gravity(
    recording: Recording, *, gravity: str = "auto", optimizer: str = "direct", seed: int = 0
) -> GravityFit:
    """Recover the gravity coefficients.

    Raises:
        InputError: gravity does not act in these logs.
    """
    model, columns = choose_gravity(recording, gravity)
    if model is None:
        raise InputError(
            "gravity does not act in these data",
            file=recording.sources[0],
            remedy=f"give a log of payload steps standing upright (`{run_command(recording, 'gravity')}`)",
        )
    fit = _found(recording, Spec("lugre", model, columns), optimizer=optimizer, seed=seed)
    points = gravity_points(fit)
    errors = [abs(p.torque - p.model) / abs(p.model) for p in points if p.model]
    # no payload was moved both ways: nothing to average
    return GravityFit(fit, points, 100.0 * float(np.mean(errors)) if errors else math.nan)


def gravity_points(fit: JointFit) -> list[GravityPoint]:
    """Measured gravity torque: what is left of the torque in steady motion after the rest of the model,
    up and down weighing the same."""
    spec, motion = fit.model.spec, fit.model.recording.motion
    if spec.gravity is None:
        return []
    coefficients = np.array([fit.values.get(f"gravity.{n}", 0.0) for n in GRAVITY_MODELS[spec.gravity]])
    torque = gravity_model.columns(spec.gravity, motion) @ coefficients
    if spec.gravity == "slide":
        if motion.payload is None:
            return []
        acting = (
            motion.gravity_factor > 0.5 if motion.gravity_factor is not None else np.ones(len(motion), bool)
        )
        group = np.where(acting & fit.model.recording.usable, np.round(motion.payload, 4), np.nan)
    else:
        usable = fit.model.recording.usable
        group = np.where(usable, np.round(motion.position / 0.2) * 0.2, np.nan)
    points = []
    up = motion.velocity > 0.5 * fit.model.scales.slowest
    down = motion.velocity < -0.5 * fit.model.scales.slowest
    for value in np.unique(group[np.isfinite(group)]):
        ways = [rows for way in (up, down) if np.count_nonzero(rows := (group == value) & way) >= 5]
        if len(ways) < 2:
            continue
        left = float(np.mean([fit.full_residual[rows].mean() for rows in ways]))
        spread = math.sqrt(sum(_standard_error(fit.full_residual[rows]) ** 2 for rows in ways)) / 2.0
        predicted = float(np.mean([torque[rows].mean() for rows in ways]))
        slide = spec.gravity == "slide"
        points.append(
            GravityPoint(
                float(value) if slide else None,
                None if slide else float(value),
                predicted + left,
                predicted,
                spread,
            )
        )
    return points


def fit_static(
    recording: Recording, known: Parameters, *, law: str = "lugre", optimizer: str = "direct", seed: int = 0
) -> StaticFit:
    """Recover the static parameters.

    A curve is fitted through the steady windows; the joint fit, which also uses the reversals between
    them, gives the parameters. In windows where the bristle has not settled, the rest of its transient
    is taken off.

    Args:
        recording: a velocity sweep, and more if there is.
        known: gravity in it is held.
        law: "lugre", "stribeck" or "coulomb".

    Raises:
        InputError: too few constant speeds: a log of another experiment.
    """
    model, columns = choose_gravity(recording)
    spec = Spec(law, model, columns)  # type: ignore[arg-type]
    fit = _found(recording, spec, optimizer=optimizer, seed=seed)
    if known.gravity and known.gravity_model == model:
        held = {f"gravity.{n}": p for n, p in known.gravity.items() if p.identified and n in columns}
        fit = _holding(fit.model, fit.values, held) if held else fit
    windows = steady_windows(fit)
    speeds = {round(window.velocity / (0.05 * fit.model.scales.speed)) for window in windows}
    if len(speeds) < LEAST_SPEEDS:
        raise InputError(
            f"{counted(len(windows), 'steady window')} at {counted(len(speeds), 'speed')} show no curve",
            file=recording.sources[0],
            remedy=f"give a velocity sweep (`{run_command(recording, 'sweep')}`)",
        )
    return StaticFit(fit, windows, *_curve(fit, windows))


def fit_dynamic(
    recording: Recording,
    known: Parameters,
    *,
    optimizer: str = "direct",
    seed: int = 0,
    evaluations: int = 30,
    progress: Callable[[int, int], None] | None = None,
) -> DynamicFit:
    """Recover sigma0 and sigma1: global search over sigma0, the rest linear; then least squares.

    Static parameters and gravity of `known` are held. Inertia is estimated along, since without it
    sigma1 is biased.

    Raises:
        InputError: nothing reverses in these data, or `known` has no static parameters.
    """
    if not known.static:
        raise InputError(
            "the parameter file has no [friction.static] yet",
            remedy="run ffc-id fit-static first, or ffc-id identify",
        )
    motion = recording.motion
    reversals = np.count_nonzero(np.diff(np.sign(motion.velocity[np.abs(motion.velocity) > 0])))
    if reversals < 2:
        raise InputError(
            "the axis never reverses in these data, so sigma0 and sigma1 do not show",
            file=recording.sources[0],
            remedy=f"give a log of sines (`{run_command(recording, 'sine')}`)",
        )
    model, columns = choose_gravity(recording)
    spec = Spec("lugre", model, columns, soft=True)  # sigma0 is what is looked for
    for name in ("inertia", "torque_offset"):
        effect = registry.get(name)
        if effect.missing(motion) is None:
            spec = spec.adding(effect)
    joint = JointModel.build(recording, spec)
    static = {name: parameter.value for name, parameter in known.static.items()}
    curve = {name: static[name] for name in ("coulomb", "static", "stribeck_velocity")}
    found = search(
        joint, fixed=curve, optimizer=optimizer, evaluations=evaluations, seed=seed, keep=2, progress=progress
    )
    held = dict(known.static)
    if known.gravity and known.gravity_model == model:
        held |= {f"gravity.{n}": p for n, p in known.gravity.items() if n in columns and p.identified}
    best = min((_holding(joint, point.values, held) for point in found), key=lambda fit: fit.sse)
    return DynamicFit(best)


def _found(recording: Recording, spec: Spec, *, optimizer: str, seed: int) -> JointFit:
    """The fit whose bristle bends as far as the data say: looked for on as few rows as show it, and fitted to
    all."""
    begin = partial(first_fit, thin(recording), optimizer=optimizer, seed=seed)
    fit = bending_fits(spec, begin)[-1]
    return refit(fit, JointModel.build(recording, fit.model.spec, fit.model.constants))


def _holding(model: JointModel, start: Mapping[str, float], held: Mapping[str, Parameter]) -> JointFit:
    """The fit from `start` with some parameters held, as sure of the others as one can be of those."""
    values = {**start, **{name: parameter.value for name, parameter in held.items()}}
    x = model.coordinates({name: values.get(name, 0.0) for name in model.names})
    unsure = [_unsure(name, held[name]) if name in held else 0.0 for name in model.names]
    return replace(solve(model, x, held=frozenset(held)), unsure=np.array(unsure))


def _unsure(name: str, parameter: Parameter) -> float:
    """Standard error of a held parameter in its coordinate; of one that is not determined what its bounds
    say, or its own size where nothing is known; 0 of one that a person declared."""
    value, logarithmic = parameter.value, name in LOGARITHMIC
    if parameter.known:
        error = parameter.stderr or 0.0
        return error / value if logarithmic else error
    ends = [end for end in (parameter.at_least, parameter.at_most) if end is not None]
    if not logarithmic:
        return max((abs(end - value) for end in ends), default=abs(value)) / _ONE_SIDED
    return max((abs(math.log(end / value)) for end in ends if end > 0.0), default=1.0) / _ONE_SIDED


def _curve(fit: JointFit, windows: Sequence[Window]) -> tuple[dict[str, float], Outcome, float]:
    """The paper's Eq. 9 through the windows, how that fit ended, and its adjusted R2."""
    friction = fit.model.friction(fit.x)
    names = ("coulomb", "static", "stribeck_velocity", "viscous")
    start = np.array([getattr(friction, name) for name in names])
    w = np.array([window.velocity for window in windows])
    torque = np.array([window.friction for window in windows])
    low = np.array([0.0, 0.0, 0.2 * start[2], -np.inf])
    high = np.array([np.inf, np.inf, 5.0 * start[2], np.inf])

    def off(x: Array) -> Array:
        return np.asarray(steady(w, *x) - torque)

    curve = minimise(off, lambda x: steady_slopes(w, *x[:3]), start, low, high, most=_CURVE_MOST)
    outcome = curve.outcome
    found = curve.x if outcome.converged else start
    left = torque - steady(w, *found)
    spare = max(len(w) - len(names) - 1, 1)
    r2 = 1.0 - float(left @ left) / max(float(np.sum((torque - torque.mean()) ** 2)), 1e-300)
    adjusted = 1.0 - (1.0 - r2) * (len(w) - 1) / spare
    return dict(zip(names, found.tolist(), strict=True)), outcome, adjusted


def _standard_error(values: Array) -> float:
    pieces = np.array_split(values, max(2, min(8, len(values) // 5)))
    return float(np.std([piece.mean() for piece in pieces], ddof=1) / math.sqrt(len(pieces)))
