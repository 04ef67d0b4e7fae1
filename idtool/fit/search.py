"""The global search: NLopt over the few nonlinear friction parameters, the rest solved in closed form.

Measured in units of a friction level, the bristle's deflection depends on three numbers only: how far
the bristle bends, the ratio of the two levels, and the Stribeck velocity. The torque is linear in
everything else, the level included. So the search has three dimensions, or one where the static
parameters are held. The level is that at a medium speed, which the data fix whatever the curve is; so the
best bend hardly depends on the curve, and after the global search a grid over curves shows every basin.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import nlopt
import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError, nearest
from idtool.fit.eliminate import filtered_moments
from idtool.fit.model import JointModel
from idtool.fit.normal_equations import in_turn
from idtool.model import lugre
from idtool.model.motion import Array
from idtool.model.stribeck import faded, fading, level
from idtool.signals.sparse_rows import SparseRows

#: name on the command line -> NLopt algorithm. DIRECT-L is deterministic; ESCH is evolutionary, the
#: paper's way; the three stochastic ones obey the seed.
OPTIMIZERS = {
    "direct": nlopt.GN_DIRECT_L,
    "crs2": nlopt.GN_CRS2_LM,
    "isres": nlopt.GN_ISRES,
    "esch": nlopt.GN_ESCH,
}
#: NLopt tells so many seeds apart; a larger one counts on from the first.
_SEEDS = 2**32
_SEARCHED = ("bend", "ratio", "stribeck_velocity")
#: The level ratio static / coulomb lies within this and its inverse.
_STEEPEST = 6.0
#: A point whose cost is within this factor of the best may end in the better minimum.
_RIVAL = 1.02
#: Grid over the friction curve that finds its other basins, and how many of them are polished.
_GRID_SPEEDS = 10
_GRID_RATIOS = (0.3, 0.6, 0.85, 1.2, 1.7, 3.0)
_BASINS = 3
#: Of `lugre.columns_of_shape`, those that act through sigma0.
_UNDAMPED = [0, 2]
#: A friction level is this share of the typical one at least.
_LEAST = 1e-3
#: Filtered rows that tell one basin from another: of more of them every second, third, ... is looked at.
_ENOUGH = 4000
#: Rows of curves that are kept, of all curves together.
_REMEMBERED = 200_000
#: Evaluations of a local polish, and its first steps (logarithms).
_POLISH = 40
_STEP = {"bend": 0.1, "ratio": 0.2, "stribeck_velocity": 0.3}


@dataclass
class Projection:
    """Cost of the shape of the friction model, everything linear solved (variable projection).

    Attributes:
        model: the model whose gravity and additive effects are the linear columns.
        coulomb: Coulomb level to hold; None solves it along.
        evaluations: how often the cost was computed.
    """

    model: JointModel
    coulomb: float | None = None
    evaluations: int = 0
    _operator: SparseRows = field(init=False)
    _pointer: NDArray[np.intp] = field(init=False)
    _fixed: Array = field(init=False)
    _products: Array = field(init=False)
    _names: list[str] = field(init=False)
    _typical: float = field(init=False)
    _curve: tuple[float, float, float] | None = field(init=False, default=None)
    _faded: dict[float, tuple[Array, Array]] = field(init=False, default_factory=dict)
    _speed: Array = field(init=False)
    _restart: NDArray[np.bool_] = field(init=False)
    _way: Array = field(init=False)
    _long: Array = field(init=False)
    _pace: Array = field(init=False)
    _signed_level: Array = field(init=False)
    _rho_speed: Array = field(init=False)

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
                if at.only_torque:
                    columns.append(np.broadcast_to(at.torque, len(motion)))
                    self._names.append(f"{effect.name}.{c.name}")
        recording = self.model.recording
        step = -(-len(recording.row) // _ENOUGH)
        looked_at = slice(None, None, step)
        self._operator = recording.model_operator.every(step)
        stretch = recording.filtered_stretch[looked_at]
        self._pointer = np.searchsorted(stretch, np.arange(motion.stretches + 1))
        self._fixed = np.column_stack(
            [
                self.model.measured[looked_at] - self._operator @ motion.braking,
                self._operator @ np.column_stack(columns),
            ]
        )
        self._speed = np.abs(motion.velocity)
        self._restart = np.zeros(len(motion), bool) if motion.restart is None else motion.restart
        self._way = motion.step_velocity * motion.step
        self._long = np.abs(self._way)
        self._products = self._fixed.T @ self._fixed
        self._typical = self.model.friction_sizes[1] if self.coulomb is None else self.coulomb

    def solve(self, shape: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Sum of squares, and all friction and linear parameters, at a shape.

        Args:
            shape: "bend" (deflection at `medium` speed, rad or m), "ratio" (static / coulomb),
                "stribeck_velocity".
        """
        self.evaluations += 1
        model, motion = self.model, self.model.recording.motion
        bend, ratio, medium = shape["bend"], shape["ratio"], self.medium_level(shape)
        curve = (1.0 / medium, ratio / medium, shape["stribeck_velocity"])
        if curve != self._curve:  # a search over the bend alone keeps its curve
            self._curve = curve
            of_steps, of_rows = self._fading(shape["stribeck_velocity"])
            over_steps = faded(of_steps, *curve[:2])
            self._pace = self._long / over_steps
            self._signed_level = np.copysign(over_steps, self._way)
            self._rho_speed = self._speed / faded(of_rows, *curve[:2])
        entering = model.recording.entering
        expected = np.sign(entering) * bend * level(entering, *curve)
        columns = lugre.columns_of_shape(
            motion.velocity,
            self._way,
            self._signed_level,
            self._pace,
            np.exp(self._pace * (-1.0 / bend)),
            self._rho_speed,
            motion.first,
            self._restart,
            expected,
            bend,
        )
        by_stretch = filtered_moments(columns, *self._operator.csr, self._fixed, self._pointer)
        if model.spec.friction != "lugre":
            by_stretch = by_stretch[:, _UNDAMPED][:, :, [*_UNDAMPED, *range(4, by_stretch.shape[2])]]
        weight = model.weight(max(curve[:2]) * bend) / self._typical
        values = self._linear(by_stretch, weight, medium)
        cost, scale = values.pop("cost"), values.pop("level")
        values |= {"coulomb": scale * curve[0], "static": scale * curve[1], "bristle_stiffness": scale / bend}
        return cost, {**values, "stribeck_velocity": shape["stribeck_velocity"]}

    def _fading(self, stribeck_velocity: float) -> tuple[Array, Array]:
        """How far the static level has faded over each step and at each row. A search comes back to the same
        Stribeck velocities: the last few are kept."""
        known = self._faded.pop(stribeck_velocity, None)
        if known is None:
            motion = self.model.recording.motion
            known = (
                fading(motion.step_velocity, stribeck_velocity),
                fading(motion.velocity, stribeck_velocity),
            )
            if (len(self._faded) + 1) * len(motion) > _REMEMBERED and self._faded:
                self._faded.pop(next(iter(self._faded)))
        self._faded[stribeck_velocity] = known
        return known

    def _linear(self, by_stretch: Array, weight: Array, medium: float) -> dict[str, float]:
        """Everything linear, and the "cost", by normal equations: the search passes the rows once.

        Args:
            by_stretch: products, over the rows of each stretch, of what a unit of its start deflection adds
                through sigma0 and, where there is one, sigma1, and of the columns of the level and of sigma1,
                with each other and with what is fixed, shape (stretches, 2 or 4, as many + fixed).
            weight: root of the weight of each start's prior, shape (stretches,).
            medium: friction level at a medium speed over the Coulomb level.
        """
        starts = by_stretch.shape[1] // 2
        added = by_stretch[:, starts:].sum(axis=0)[:, starts:]
        products = np.empty((added.shape[1], added.shape[1]))
        products[: len(added)], products[len(added) :, : len(added)] = added, added[:, len(added) :].T
        products[len(added) :, len(added) :] = self._products
        names = [*("level", "bristle_damping")[: len(added)], "measured", *self._names]
        # what is held is known, and goes to the other side
        held = math.nan if self.coulomb is None else self.coulomb * medium
        order = [names.index("measured"), *(k for k, name in enumerate(names) if name != "measured")]
        turn = np.eye(len(names))[order]
        if self.coulomb is not None:
            turn[0, 0] = -held
            turn = np.delete(turn, 1, axis=0)
            names.remove("level")
        names.remove("measured")
        damping = names.index("bristle_damping") if "bristle_damping" in names else -1
        least = _LEAST * self._typical
        cost, solution = in_turn(
            turn @ products @ turn.T,
            by_stretch[:, :starts, starts:] @ turn.T,
            by_stretch[:, :starts, :starts].copy(),
            weight,
            len(names) - len(self._names) + 1,
            damping,
            held,
            least,
        )
        values = dict(zip(names, solution.tolist(), strict=True))
        values["level"] = max(values["level"], least) if self.coulomb is None else held
        return {**values, "cost": cost}

    @property
    def rows(self) -> int:
        """How many filtered rows are looked at."""
        return len(self._fixed)

    def medium_level(self, shape: Mapping[str, float]) -> float:
        """Friction level at a medium speed over the Coulomb level."""
        s = self.model.scales
        medium = np.array([math.sqrt(s.slowest * s.speed)])
        return float(level(medium, 1.0, shape["ratio"], shape["stribeck_velocity"])[0])


@dataclass(frozen=True)
class Found:
    """Where a search ended: all parameters by name, best first in a list of these."""

    cost: float
    values: dict[str, float]


@dataclass
class _Search:
    """The points that a search has seen; coordinates are logarithms of the shape's free numbers."""

    projection: Projection
    held: dict[str, float]
    free: list[str]
    low: Array
    high: Array
    tell: Callable[[int], None]
    seen: list[tuple[float, Array, dict[str, float]]] = field(default_factory=list)

    def cost(self, x: Array, _gradient: Array | None = None) -> float:
        shape = {**self.held, **{name: math.exp(v) for name, v in zip(self.free, x, strict=True)}}
        value, values = self.projection.solve(shape)
        self.seen.append((value, np.array(x), values))
        self.tell(len(self.seen))
        return value

    def run(self, algorithm: int, start: Array, evaluations: int, step: Array | None = None) -> Array:
        """Best point of one NLopt run."""
        first = len(self.seen)
        optimiser = nlopt.opt(algorithm, len(self.free))
        optimiser.set_lower_bounds(self.low)
        optimiser.set_upper_bounds(self.high)
        optimiser.set_min_objective(self.cost)
        optimiser.set_maxeval(evaluations)
        if step is not None:
            optimiser.set_initial_step(step)
            optimiser.set_xtol_abs(1e-3)
            optimiser.set_ftol_rel(1e-4)
        with contextlib.suppress(nlopt.RoundoffLimited):  # the best point is in `seen` all the same
            optimiser.optimize(np.clip(start, self.low, self.high))
        return min(self.seen[first:], key=lambda item: item[0])[1]

    def polish(self, start: Array) -> Array:
        """Local search without derivatives."""
        algorithm = nlopt.LN_BOBYQA if len(self.free) > 1 else nlopt.LN_COBYLA
        return self.run(algorithm, start, _POLISH, np.array([_STEP[name] for name in self.free]))

    def other_basins(self, best: Array) -> list[Array]:
        """Local minima on a grid of friction curves, the bend as at `best`; lowest first."""
        if "ratio" not in self.free or "stribeck_velocity" not in self.free:
            return []
        i, j = self.free.index("stribeck_velocity"), self.free.index("ratio")
        speeds = np.linspace(self.low[i], self.high[i], _GRID_SPEEDS)
        costs = np.empty((len(speeds), len(_GRID_RATIOS)))
        points = {}
        for a, speed in enumerate(speeds):
            for b, ratio in enumerate(_GRID_RATIOS):
                x = best.copy()
                x[i], x[j] = speed, max(math.log(ratio), self.low[j])
                points[a, b] = x
                costs[a, b] = self.cost(x)
        padded = np.pad(costs, 1, constant_values=np.inf)
        around = np.stack([padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]])
        lowest = np.argwhere(costs <= around.min(axis=0))
        ordered = sorted((tuple(place) for place in lowest), key=lambda place: costs[place])
        return [points[int(a), int(b)] for a, b in ordered[:_BASINS]]


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
    """Search the shape of the friction model globally, then polish locally.

    Args:
        model: gravity and additive effects in it are solved as linear unknowns.
        fixed: "coulomb", "static" and "stribeck_velocity" to hold, for a search over sigma0 alone.
        optimizer: a key of `OPTIMIZERS`.
        evaluations: how many costs the global search computes.
        seed: for the stochastic optimisers.
        keep: how many different points to hand back at most.
        progress: called with (done, all).

    Returns:
        The best points, best first.

    Raises:
        InputError: unknown optimiser.
    """
    if optimizer not in OPTIMIZERS:
        raise InputError(
            f"unknown optimizer {optimizer!r}", argument="optimizer", remedy=nearest(optimizer, OPTIMIZERS)
        )
    held: dict[str, float] = {}
    if fixed is not None:
        held = {"ratio": fixed["static"] / fixed["coulomb"], "stribeck_velocity": fixed["stribeck_velocity"]}
    law = model.spec.friction
    if law != "lugre":
        held["bend"] = model.scales.shortest_bend
    if law == "coulomb":
        held |= {"stribeck_velocity": model.scales.slowest, "ratio": 1.0}
    free = [name for name in _SEARCHED if name not in held]
    low, high = _box(model, free)
    most = evaluations + _POLISH
    state = _Search(
        Projection(model, None if fixed is None else fixed["coulomb"]),
        held,
        free,
        low,
        high,
        lambda done: progress(min(done, most), most) if progress is not None else None,
    )
    if free:
        nlopt.srand((seed + 1) % _SEEDS)
        best = state.polish(state.run(OPTIMIZERS[optimizer], 0.5 * (low + high), evaluations))
        for start in state.other_basins(best):
            state.polish(start)
    else:
        state.cost(np.empty(0))
    return _different(state.seen, high - low, keep)


def cost_over_stiffness(model: JointModel, values: Mapping[str, float]) -> tuple[Array, Array]:
    """Root-mean-square residual over the bristle stiffness, static parameters held, linear ones solved."""
    low, high = _box(model, ["bend"])
    bends = np.exp(np.linspace(high[0], low[0], 41))
    projection = Projection(model, values["coulomb"])
    shape = {
        "ratio": values["static"] / values["coulomb"],
        "stribeck_velocity": values["stribeck_velocity"],
    }
    costs = [projection.solve({**shape, "bend": float(bend)})[0] for bend in bends]
    level = values["coulomb"] * projection.medium_level(shape)
    return level / bends, np.sqrt(np.array(costs) / projection.rows)


def _box(model: JointModel, names: list[str]) -> tuple[Array, Array]:
    s = model.scales
    table = {
        "bend": (math.log(s.shortest_bend), math.log(0.5 * model.longest_bend)),
        "stribeck_velocity": (math.log(0.5 * s.slowest), math.log(s.widest_curve)),
        "ratio": (0.0 if model.spec.falling else -math.log(_STEEPEST), math.log(_STEEPEST)),
    }
    return np.array([table[n][0] for n in names]), np.array([table[n][1] for n in names])


def _different(seen: list[tuple[float, Array, dict[str, float]]], span: Array, keep: int) -> list[Found]:
    """The best point and its rivals that lie apart by a tenth of the box in some coordinate."""
    ordered = sorted(seen, key=lambda item: item[0])
    chosen = ordered[:1]
    for item in ordered:
        if len(chosen) == keep or item[0] > _RIVAL * ordered[0][0]:
            break
        if all(np.any(np.abs(item[1] - other[1]) > 0.1 * span) for other in chosen):
            chosen.append(item)
    return [Found(cost, values) for cost, _, values in chosen]
