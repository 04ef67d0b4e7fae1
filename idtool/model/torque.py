"""The torque of the axis: gravity, LuGre friction and effects, summed; and its derivatives.

    K i = sum of additive torques + sigma0 z + sigma1 dz/dt + sigma2 w

`Friction` holds the numbers of the friction model, `Direction` a derivative of everything with respect
to one parameter. `predict` evaluates, `linearise` evaluates and propagates every direction exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from idtool.model import lugre
from idtool.model.contribution import Contribution, Term, is_zero
from idtool.model.motion import Array, Motion
from idtool.model.stribeck import EXPONENT

#: The friction level never falls below this share of its plain value, whatever effects do to it.
_LEVEL_FLOOR = 0.02


@dataclass(frozen=True)
class Friction:
    """LuGre parameters, SI (torque stands for force on a linear axis)."""

    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float
    bristle_stiffness: float
    bristle_damping: float


@dataclass(frozen=True)
class Direction:
    """Derivative of the model's inputs with respect to one parameter; what is not named is 0.

    Attributes:
        origin: the parameter's name, and what else the derivative depends on; None where that is not known.
    """

    coulomb: float = 0.0
    static: float = 0.0
    stribeck_velocity: float = 0.0
    viscous: float = 0.0
    bristle_stiffness: float = 0.0
    bristle_damping: float = 0.0
    effect: Contribution = field(default_factory=Contribution)
    origin: tuple[str, object] | None = None

    @cached_property
    def only_adds(self) -> bool:
        """Whether it adds a torque and touches nothing else."""
        base = (*self._base, self.viscous, self.bristle_damping)
        others = [getattr(self.effect, f.name) for f in fields(Contribution) if f.name != "torque"]
        return not any(base) and all(is_zero(term) for term in others)

    @property
    def _base(self) -> tuple[float, ...]:
        return (self.coulomb, self.static, self.stribeck_velocity, self.bristle_stiffness)

    def bends_bristle(self) -> bool:
        """Whether the bristle's state depends on this parameter."""
        e = self.effect
        touched = (e.level_change, e.level_torque, e.static_change, e.exponent_change)
        return any(self._base) or any(not (isinstance(t, float) and t == 0.0) for t in touched)


@dataclass(frozen=True)
class Prediction:
    """Shape (rows,) each.

    Attributes:
        torque: predicted measured torque K i.
        start_column: derivative of `torque` with respect to the start deflection of the row's stretch.
        bristle: deflection z.
    """

    torque: Array
    start_column: Array
    bristle: Array


def predict(motion: Motion, friction: Friction, effect: Contribution, start: Array) -> Prediction:
    """Predicted torque.

    Args:
        motion: the rows.
        friction: LuGre parameters.
        effect: the sum of gravity and all effects, see `Contribution`.
        start: bristle deflection at the start of each stretch (`lugre.propagate`), shape (stretches,).
    """
    level = _Level(motion.step_velocity, friction, _at_step(effect, motion))
    rho = friction.bristle_stiffness / level.value
    along = motion.step_velocity, motion.step, rho, motion.first
    z, decay = lugre.propagate(*along, start, motion.restart)
    at_row = _Level(motion.velocity, friction, effect)
    return _output(motion, effect, _finish(motion, friction, effect, at_row, z, decay), None, ())[0]


def linearise(
    motion: Motion, friction: Friction, effect: Contribution, start: Array, directions: Sequence[Direction]
) -> tuple[Prediction, Array]:
    """Predicted torque and its derivative along each direction, shape (rows, directions)."""
    at_step = _Level(motion.step_velocity, friction, _at_step(effect, motion))
    at_row = _Level(motion.velocity, friction, effect)
    bending = [index for index, direction in enumerate(directions) if direction.bends_bristle()]
    dlog_rho = np.empty((len(motion), len(bending)))
    for place, index in enumerate(bending):
        step_effect = _at_step(directions[index].effect, motion)
        dlog_rho[:, place] = at_step.dlog_rho(directions[index], step_effect, friction)
    rho_step = friction.bristle_stiffness / at_step.value
    along = motion.step_velocity, motion.step, rho_step, motion.first
    z, decay, tangents = lugre.propagate_tangents(*along, start, dlog_rho, motion.restart)
    prediction = _finish(motion, friction, effect, at_row, z, decay)
    rho_speed = friction.bristle_stiffness / at_row.value * np.abs(motion.velocity)
    z_rate = motion.velocity - rho_speed * z
    passed = 1.0 + effect.bristle_change
    through_z = passed * (friction.bristle_stiffness - friction.bristle_damping * rho_speed)
    through_log = passed * (friction.bristle_damping * rho_speed * z)
    # one row per direction: a column of a matrix stored by rows is slow to write
    jacobian = np.zeros((len(directions), len(motion)))
    for column, direction in zip(jacobian, directions, strict=True):
        if direction.bristle_stiffness:
            column += direction.bristle_stiffness * passed * z
        if direction.bristle_damping:
            column += direction.bristle_damping * passed * z_rate
        if not is_zero(direction.effect.bristle_change):
            bristle = friction.bristle_stiffness * z + friction.bristle_damping * z_rate
            column += direction.effect.bristle_change * bristle
        if direction.viscous:
            column += direction.viscous * (1.0 + effect.viscous_change) * motion.velocity
        if not is_zero(direction.effect.viscous_change):
            column += friction.viscous * direction.effect.viscous_change * motion.velocity
        if not is_zero(direction.effect.torque):
            column += direction.effect.torque
    for place, index in enumerate(bending):
        row_dlog = at_row.dlog_rho(directions[index], directions[index].effect, friction)
        jacobian[index] += through_z * tangents[:, place] - through_log * row_dlog
    return _output(motion, effect, prediction, jacobian.T, directions)


class _Level:
    """g over rows or steps, and the derivative of ln(sigma0 / g)."""

    def __init__(self, velocity: Array, friction: Friction, effect: Contribution) -> None:
        self.exponent = EXPONENT + effect.exponent_change
        self.ratio = np.abs(velocity) / friction.stribeck_velocity
        self.power = (
            self.ratio * self.ratio
            if isinstance(self.exponent, float) and self.exponent == 2.0
            else (self.ratio**self.exponent)
        )
        self.fade = np.exp(-self.power)
        self.static = friction.static * (1.0 + effect.static_change)
        self.plain = friction.coulomb + (self.static - friction.coulomb) * self.fade
        self.scale = 1.0 + effect.level_change
        floor = _LEVEL_FLOOR * min(friction.coulomb, friction.static) + 1e-12
        self.value: Array = np.maximum(self.plain * self.scale + effect.level_torque, floor)

    def dlog_rho(self, direction: Direction, effect: Contribution, friction: Friction) -> Array:
        """Derivative of ln(sigma0 / g) along `direction`, whose effect part is `effect`."""
        change: Term = 0.0
        if direction.coulomb:
            change = direction.coulomb * (1.0 - self.fade)
        if direction.static:
            change = change + direction.static * (self.static / friction.static) * self.fade
        if not is_zero(effect.static_change):
            change = change + friction.static * effect.static_change * self.fade
        if direction.stribeck_velocity or not is_zero(effect.exponent_change):
            bend: Term = 0.0
            if direction.stribeck_velocity:
                bend = self.exponent * self.power * direction.stribeck_velocity / friction.stribeck_velocity
            if not is_zero(effect.exponent_change):
                bend = bend - self.power * np.log(np.maximum(self.ratio, 1e-12)) * effect.exponent_change
            change = change + (self.static - friction.coulomb) * self.fade * bend
        if not is_zero(change):
            change = self.scale * change
        if not is_zero(effect.level_change):
            change = change + self.plain * effect.level_change
        change = change + effect.level_torque
        stiff = direction.bristle_stiffness / friction.bristle_stiffness
        return np.asarray(stiff if is_zero(change) else stiff - change / self.value, dtype=float)


def _at_step(effect: Contribution, motion: Motion) -> Contribution:
    """The level terms of a contribution, averaged over each step."""
    return Contribution(
        **{
            field.name: motion.at_step(value)
            if isinstance(value := getattr(effect, field.name), np.ndarray)
            else value
            for field in fields(Contribution)
            if field.name in ("level_change", "level_torque", "static_change", "exponent_change")
        }
    )


def _finish(
    motion: Motion, friction: Friction, effect: Contribution, level: _Level, z: Array, decay: Array
) -> Prediction:
    """The torque before what acts on the finished torque (`_output`)."""
    rho_speed = friction.bristle_stiffness / level.value * np.abs(motion.velocity)
    passed = 1.0 + effect.bristle_change
    through_z = passed * (friction.bristle_stiffness - friction.bristle_damping * rho_speed)
    torque = through_z * z + passed * friction.bristle_damping * motion.velocity
    torque += friction.viscous * (1.0 + effect.viscous_change) * motion.velocity
    torque += effect.torque
    return Prediction(torque, through_z * decay, z)


def _output(
    motion: Motion,
    effect: Contribution,
    prediction: Prediction,
    jacobian: Array | None,
    directions: Sequence[Direction],
) -> tuple[Prediction, Array]:
    """Delay and torque saturation, which act on the finished torque."""
    torque, start_column = prediction.torque, prediction.start_column
    derivative = np.empty((len(torque), 0)) if jacobian is None else jacobian
    delay_used = not is_zero(effect.delay) or any(not is_zero(d.effect.delay) for d in directions)
    if delay_used:
        delay = float(np.mean(effect.delay))
        later = _Shift(motion, delay)
        slope = later.slope(torque)
        torque, start_column = later(torque), later(start_column)
        derivative = (
            np.column_stack([later(column) for column in derivative.T]) if derivative.size else derivative
        )
        for index, direction in enumerate(directions):
            if not is_zero(direction.effect.delay):
                derivative[:, index] += slope * direction.effect.delay
    saturating = not is_zero(effect.saturation) or any(not is_zero(d.effect.saturation) for d in directions)
    if saturating:
        # K i (1 - s |K i|) = torque, solved for K i; the smaller root is the physical one
        s = effect.saturation
        inside = np.maximum(1.0 - 4.0 * s * np.abs(torque), 0.04)
        measured = 2.0 * torque / (1.0 + np.sqrt(inside))
        gain = 1.0 / np.sqrt(inside)
        derivative = derivative * gain[:, None]
        for index, direction in enumerate(directions):
            if not is_zero(direction.effect.saturation):
                derivative[:, index] += gain * np.abs(measured) * measured * direction.effect.saturation
        torque, start_column = measured, start_column * gain
    return replace(prediction, torque=torque, start_column=start_column), derivative


@numba.njit(cache=True)
def _between(values: Array, left: NDArray[np.intp], right: NDArray[np.intp], weight: Array) -> Array:
    """Linear interpolation; indexing by arrays in numpy takes twenty times as long."""
    out = np.empty(len(left))
    for k in range(len(left)):
        out[k] = values[left[k]] * (1.0 - weight[k]) + values[right[k]] * weight[k]
    return out


@numba.njit(cache=True)
def _interval(
    time: Array, first: NDArray[np.bool_], delay: float
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, Array]:
    """Rows of its own trial between which `time + delay` of each row lies, how far along, their distance."""
    rows = len(time)
    left, right = np.empty(rows, dtype=np.intp), np.empty(rows, dtype=np.intp)
    weight, span = np.empty(rows), np.empty(rows)
    begin = 0
    while begin < rows:
        last = begin
        while last + 1 < rows and not first[last + 1]:
            last += 1
        at = min(begin + 1, last)
        for k in range(begin, last + 1):
            wanted = min(max(time[k] + delay, time[begin]), time[last])
            while at < last and time[at] < wanted:
                at += 1
            before = max(at - 1, begin)
            apart = time[at] - time[before]
            left[k], right[k] = before, at
            weight[k] = (wanted - time[before]) / apart if apart > 0 else 0.0
            span[k] = apart if apart > 0 else 1.0
        begin = last + 1
    return left, right, weight, span


class _Shift:
    """Read a row quantity at `time + delay` inside its own trial (held beyond its ends)."""

    def __init__(self, motion: Motion, delay: float) -> None:
        self.left, self.right, self.weight, self.span = _interval(motion.time, motion.first, delay)

    def __call__(self, values: Array) -> Array:
        return _between(np.ascontiguousarray(values), self.left, self.right, self.weight)

    def slope(self, values: Array) -> Array:
        return np.asarray((values[self.right] - values[self.left]) / self.span)
