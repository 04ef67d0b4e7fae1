"""The global search: NLopt over the few nonlinear friction parameters, the rest solved in closed form.

Given the friction levels, the Stribeck velocity and the bristle stiffness, the bristle's deflection is
known, and the torque is linear in everything else. So the search has four dimensions, or one (the
logarithm of sigma0) where the static parameters are held.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import nlopt
import numpy as np

from idtool.errors import InputError, nearest
from idtool.fit.model import JointModel
from idtool.model import lugre
from idtool.model.contribution import Contribution
from idtool.model.motion import Array
from idtool.model.stribeck import level

#: name on the command line -> NLopt algorithm. DIRECT-L is deterministic; ESCH is evolutionary, the
#: paper's way; the three stochastic ones obey the seed.
OPTIMIZERS = {
    "direct": nlopt.GN_DIRECT_L,
    "crs2": nlopt.GN_CRS2_LM,
    "isres": nlopt.GN_ISRES,
    "esch": nlopt.GN_ESCH,
}
_SEARCHED = ("bristle_stiffness", "stribeck_velocity", "coulomb", "static")


@dataclass
class Projection:
    """Cost of the nonlinear friction parameters, everything linear solved (variable projection).

    Attributes:
        model: the model whose gravity and additive effects are the linear columns.
        evaluations: how often the cost was computed.
    """

    model: JointModel
    evaluations: int = 0
    _fixed: Array = field(init=False)
    _names: list[str] = field(init=False)
    _curve: tuple[float, float, float] | None = field(init=False, default=None)
    _over_steps: Array = field(init=False)
    _over_rows: Array = field(init=False)

    def __post_init__(self) -> None:
        motion = self.model.recording.motion
        columns = [motion.velocity]
        self._names = ["viscous"]
        for index, name in enumerate(self.model.spec.gravity_columns):
            columns.append(self.model.gravity_columns[:, index])
            self._names.append(f"gravity.{name}")
        for effect in self.model.spec.effects:
            constants = self.model.constants[effect.name]
            coordinates = effect.active(motion)
            null = {c.name: c.null for c in coordinates}
            for c in coordinates:
                at = effect.contribute(motion, {**constants, **null, c.name: c.null + 1.0})
                if isinstance(at.torque, np.ndarray) and at == Contribution(torque=at.torque):
                    columns.append(at.torque)
                    self._names.append(f"{effect.name}.{c.name}")
        self._fixed = self.model.recording.filtered(np.column_stack(columns))

    def solve(self, friction: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Sum of squares and the linear parameters at given levels, Stribeck velocity and stiffness."""
        self.evaluations += 1
        model, motion = self.model, self.model.recording.motion
        stiffness = friction["bristle_stiffness"]
        curve = (friction["coulomb"], friction["static"], friction["stribeck_velocity"])
        if curve != self._curve:  # a search over the stiffness alone keeps its curve
            self._curve = curve
            self._over_steps = 1.0 / level(motion.step_velocity, *curve)
            self._over_rows = np.abs(motion.velocity) / level(motion.velocity, *curve)
        z, decay = lugre.propagate(
            motion.step_velocity,
            motion.step,
            stiffness * self._over_steps,
            motion.first,
            np.zeros(motion.trials),
        )
        rate = motion.velocity - stiffness * self._over_rows * z
        damped = model.spec.friction == "lugre"
        new = model.recording.filtered_columns(z, decay, rate)
        new[:, :2] *= stiffness
        columns = np.column_stack(
            [model.measured - new[:, 0], new[:, 2:] if damped else new[:, :0], self._fixed]
        )
        bend = max(curve[0], curve[1]) / stiffness
        free, _ = model.eliminate_columns(columns, new[:, 1], bend)
        names = (["bristle_damping"] if damped else []) + self._names
        target, regressors = free[:, 0], free[:, 1:]
        solution = np.linalg.lstsq(regressors, target, rcond=1e-10)[0]
        if damped and solution[0] < 0:
            solution = np.concatenate([[0.0], np.linalg.lstsq(regressors[:, 1:], target, rcond=1e-10)[0]])
        residual = target - regressors @ solution
        return float(residual @ residual), dict(zip(names, solution.tolist(), strict=True))


@dataclass(frozen=True)
class Found:
    """Where a search ended: all parameters by name, best first in a list of these."""

    cost: float
    values: dict[str, float]


def search(
    model: JointModel,
    *,
    fixed: Mapping[str, float] | None = None,
    optimizer: str = "direct",
    evaluations: int = 200,
    seed: int = 0,
    keep: int = 3,
    progress: Callable[[int, int], None] | None = None,
) -> list[Found]:
    """Search the nonlinear friction parameters globally.

    Args:
        model: gravity and additive effects in it are solved as linear unknowns.
        fixed: parameters held at a value (the static set, for a search over sigma0 alone).
        optimizer: a key of `OPTIMIZERS`.
        evaluations: how many costs to compute.
        seed: for the stochastic optimisers.
        keep: how many different points to hand back.
        progress: called with (done, all).

    Returns:
        The best points, best first.

    Raises:
        InputError: unknown optimiser.
    """
    if optimizer not in OPTIMIZERS:
        raise InputError(f"unknown optimizer {optimizer!r}", remedy=nearest(optimizer, OPTIMIZERS))
    projection = Projection(model)
    held = dict(fixed or {})
    law = model.spec.friction
    if law != "lugre":
        held.setdefault("bristle_stiffness", model.stiff)
    if law == "coulomb":
        held.setdefault("stribeck_velocity", model.scales.slowest)
    free = [name for name in _SEARCHED if name not in held and not (law == "coulomb" and name == "static")]
    low, high = _box(model, free)
    seen: list[tuple[float, Array, dict[str, float]]] = []

    def named(x: Array) -> dict[str, float]:
        values = {**held, **{name: math.exp(v) for name, v in zip(free, x, strict=True)}}
        values.setdefault("static", values["coulomb"])
        return values

    def cost(x: Array, _gradient: Array) -> float:
        point = named(x)
        value, linear = projection.solve(point)
        seen.append((value, x.copy(), {**point, **linear}))
        if progress is not None:
            progress(len(seen), evaluations)
        return value

    if free:
        nlopt.srand(seed + 1)
        optimiser = nlopt.opt(OPTIMIZERS[optimizer], len(free))
        optimiser.set_lower_bounds(low)
        optimiser.set_upper_bounds(high)
        optimiser.set_min_objective(cost)
        optimiser.set_maxeval(evaluations)
        optimiser.set_xtol_abs(1e-4)
        optimiser.optimize(0.5 * (low + high))
    else:
        cost(np.empty(0), np.empty(0))
    return _different(seen, high - low, keep)


def cost_over_stiffness(
    model: JointModel, values: Mapping[str, float], points: int = 41
) -> tuple[Array, Array]:
    """Root-mean-square residual over the bristle stiffness, static parameters held, linear ones solved."""
    low, high = _box(model, ["bristle_stiffness"])
    grid = np.exp(np.linspace(low[0], high[0], points))
    projection = Projection(model)
    costs = [projection.solve({**values, "bristle_stiffness": float(s)})[0] for s in grid]
    return grid, np.sqrt(np.array(costs) / len(model.measured))


def _box(model: JointModel, names: list[str]) -> tuple[Array, Array]:
    s = model.scales
    level_low, level_high = math.log(0.05 * s.torque), math.log(2.0 * _moving_torque(model))
    table = {
        "bristle_stiffness": (math.log(0.1 * s.torque / s.travel), math.log(s.torque / s.shortest_bend)),
        "stribeck_velocity": (math.log(0.5 * s.slowest), math.log(1.2 * s.speed)),
        "coulomb": (level_low, level_high),
        "static": (level_low, level_high),
    }
    return np.array([table[n][0] for n in names]), np.array([table[n][1] for n in names])


def _moving_torque(model: JointModel) -> float:
    """The most that friction can be: the torque's spread with gravity regressed out."""
    target = model.measured
    columns = model.recording.filtered(model.gravity_columns) if model.spec.gravity_columns else None
    if columns is not None:
        target = target - columns @ np.linalg.lstsq(columns, target, rcond=1e-10)[0]
    return float(np.quantile(np.abs(target - np.median(target)), 0.98)) + 1e-12


def _different(seen: list[tuple[float, Array, dict[str, float]]], span: Array, keep: int) -> list[Found]:
    """The best points that lie apart by a tenth of the box in some coordinate."""
    ordered = sorted(seen, key=lambda item: item[0])
    chosen: list[tuple[float, Array, dict[str, float]]] = []
    for item in ordered:
        if all(np.any(np.abs(item[1] - other[1]) > 0.1 * span) for other in chosen) or not chosen:
            chosen.append(item)
        if len(chosen) == keep:
            break
    return [Found(cost, values) for cost, _, values in chosen]
