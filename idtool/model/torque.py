"""The torque of the axis: gravity, LuGre friction and effects, summed; and its derivatives.

    K i = sum of additive torques + sigma0 z + sigma1 dz/dt + sigma2 w

`Friction` holds the numbers of the friction model, `Direction` a derivative of everything with respect
to one parameter. `predict` evaluates, `linearise` evaluates and propagates every direction exactly.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from idtool.model import lugre
from idtool.model.contribution import Contribution, Term, is_zero
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.stribeck import EXPONENT

#: The friction level never falls below this share of its plain value, whatever effects do to it.
_LEVEL_FLOOR = 0.02
#: ... nor the torque per current below this share of the plain one.
_LEAST_GAIN = 0.2
#: Places of a `Contribution` that the friction level depends on.
_OF_LEVEL = ("level_change", "level_torque", "static_change", "exponent_change")


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
        return not any(base) and self.effect.is_torque_at_most

    @property
    def _base(self) -> tuple[float, ...]:
        return (self.coulomb, self.static, self.stribeck_velocity, self.bristle_stiffness)

    def bends_bristle(self) -> bool:
        """Whether the bristle's state depends on this parameter."""
        touched = (getattr(self.effect, name) for name in _OF_LEVEL)
        return any(self._base) or not all(map(is_zero, touched))


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
    return _Finished(motion, effect, _finish(motion, friction, effect, at_row, z, decay)).prediction


def linearise(
    motion: Motion, friction: Friction, effect: Contribution, start: Array, directions: Sequence[Direction]
) -> tuple[Prediction, Iterator[Array]]:
    """Predicted torque and its derivative along each direction, one after another, shape (rows,) each."""
    at_step = _Level(motion.step_velocity, friction, _at_step(effect, motion))
    at_row = _Level(motion.velocity, friction, effect)
    rho_step = friction.bristle_stiffness / at_step.value
    along = motion.step_velocity, motion.step, rho_step, motion.first
    z, decay, tangent = lugre.propagate_tangents(*along, start, motion.restart)
    finished = _Finished(motion, effect, _finish(motion, friction, effect, at_row, z, decay), directions)

    def derivatives() -> Iterator[Array]:
        rho_speed = friction.bristle_stiffness / at_row.value * np.abs(motion.velocity)
        z_rate = motion.velocity - rho_speed * z
        passed = 1.0 + effect.bristle_change
        through_z = passed * (friction.bristle_stiffness - friction.bristle_damping * rho_speed)
        through_log = passed * (friction.bristle_damping * rho_speed * z)
        for direction in directions:
            along = direction.effect
            column = np.zeros(len(motion))
            if direction.bristle_stiffness:
                column += direction.bristle_stiffness * passed * z
            if direction.bristle_damping:
                column += direction.bristle_damping * passed * z_rate
            if not is_zero(along.bristle_change):
                bristle = friction.bristle_stiffness * z + friction.bristle_damping * z_rate
                column += along.bristle_change * bristle
            if direction.viscous:
                column += direction.viscous * (1.0 + effect.viscous_change) * motion.velocity
            if not is_zero(along.viscous_change):
                column += friction.viscous * along.viscous_change * motion.velocity
            if not is_zero(along.torque):
                column += along.torque
            if direction.bends_bristle():
                over_step = at_step.dlog_rho(direction, _at_step(along, motion), friction)
                at_end = at_row.dlog_rho(direction, along, friction)
                column += through_z * tangent(np.broadcast_to(over_step, z.shape)) - through_log * at_end
            yield finished.derivative(column, along)

    return finished.prediction, derivatives()


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
    terms = {name: getattr(effect, name) for name in _OF_LEVEL}
    return Contribution(
        **{name: motion.at_step(t) if isinstance(t, np.ndarray) else t for name, t in terms.items()}
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


class _Finished:
    """What acts on the finished torque: delay, and what the motor gives per current.

    Attributes:
        prediction: the torque behind them.
    """

    def __init__(
        self,
        motion: Motion,
        effect: Contribution,
        prediction: Prediction,
        directions: Sequence[Direction] = (),
    ) -> None:
        acting = [effect, *(direction.effect for direction in directions)]
        torque, start_column = prediction.torque, prediction.start_column
        self._later = None
        if any(not is_zero(one.delay) for one in acting):
            self._later = _Shift(motion, float(np.mean(effect.delay)))
            self._slope = self._later.slope(torque)
            torque, start_column = self._later(torque), self._later(start_column)
        self._gain: Term = 1.0
        if any(not is_zero(one.saturation) or not is_zero(one.gain_change) for one in acting):
            # K i (gain - s |K i|) = torque, solved for K i; the smaller root is the physical one
            gain = np.maximum(1.0 + effect.gain_change, _LEAST_GAIN)
            inside = np.sqrt(np.maximum(gain * gain - 4.0 * effect.saturation * np.abs(torque), 0.04))
            torque, self._gain = 2.0 * torque / (gain + inside), 1.0 / inside
            start_column = start_column * self._gain
        self.prediction = replace(prediction, torque=torque, start_column=start_column)

    def derivative(self, column: Array, along: Contribution) -> Array:
        """Of the torque behind, from that of the torque before; `along` holds the direction's effects."""
        if self._later is not None:
            column = self._later(column)
            if not is_zero(along.delay):
                column = column + self._slope * along.delay
        if not is_zero(along.saturation):
            measured = self.prediction.torque
            column = column + np.abs(measured) * measured * along.saturation
        if not is_zero(along.gain_change):
            column = column - self.prediction.torque * along.gain_change
        return column if isinstance(self._gain, float) else column * self._gain


@jit()
def _between(values: Array, left: NDArray[np.intp], right: NDArray[np.intp], weight: Array) -> Array:
    """Linear interpolation; indexing by arrays in numpy takes twenty times as long."""
    out = np.empty(len(left))
    for k in range(len(left)):
        out[k] = values[left[k]] * (1.0 - weight[k]) + values[right[k]] * weight[k]
    return out


@jit()
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
