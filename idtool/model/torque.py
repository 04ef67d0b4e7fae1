"""The torque of the axis: gravity, LuGre friction and effects, summed; and its derivatives.

    K i = sum of additive torques + sigma0 z + sigma1 dz/dt + sigma2 w

`Friction` holds the numbers of the friction model, `Direction` a derivative of everything with respect
to one parameter. `predict` evaluates, `linearise` evaluates and propagates every direction exactly.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from idtool.model import lugre
from idtool.model.contribution import Contribution, Term, is_zero
from idtool.model.finished import Finished
from idtool.model.jit import jit
from idtool.model.motion import Array, Motion
from idtool.model.stribeck import EXPONENT, least_level

#: Places of a `Contribution` that the friction level depends on.
_OF_LEVEL = ("level_change", "level_torque", "static_change", "exponent_change")
#: Places that act on the finished torque (`idtool.model.finished`).
ON_FINISHED = ("delay", "saturation", "gain_change")
#: Derivatives that are computed at a time.
BLOCK = lugre.BLOCK


@dataclass(frozen=True)
class Friction:
    """LuGre parameters, SI (torque stands for force on a linear axis)."""

    coulomb: float
    static: float
    stribeck_velocity: float
    viscous: float
    bristle_stiffness: float
    bristle_damping: float


_NOTHING = Contribution()


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
    effect: Contribution = _NOTHING
    origin: tuple[object, object] | None = None

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
        return any(self._base) or any(place in _OF_LEVEL for place in self.effect.places)


@dataclass(frozen=True)
class Prediction:
    """Shape (rows,) each.

    Attributes:
        torque: predicted measured torque K i.
        start_column: derivative of `torque` with respect to the start deflection of the row's stretch.
        bristle: deflection z that the next step starts from.
    """

    torque: Array
    start_column: Array
    bristle: Array


def predict(
    motion: Motion, friction: Friction, effect: Contribution, start: Array, *, settled: bool = True
) -> Prediction:
    """Predicted torque.

    Args:
        motion: the rows.
        friction: LuGre parameters.
        effect: the sum of gravity and all effects, see `Contribution`.
        start: bristle deflection at the start of each stretch (`lugre.propagate`), shape (stretches,).
        settled: whether what slid in a step is bent to the level of the step's end. A controller, whose steps
            are short, goes without, as its C has no time to spare.
    """
    return At(motion, friction, effect, settled=settled).predict(start)


def linearise(
    motion: Motion, friction: Friction, effect: Contribution, start: Array, directions: Sequence[Direction]
) -> tuple[Prediction, Iterator[Array]]:
    """Predicted torque and its derivative along each direction, one after another, shape (rows,) each."""
    prediction, blocks = At(motion, friction, effect).linearise(start, directions)
    each = (column.copy() for block in blocks for column in block)
    return prediction, itertools.islice(each, len(directions))


class At:
    """The model at one set of parameters: what is asked of it twice there is computed once."""

    def __init__(
        self, motion: Motion, friction: Friction, effect: Contribution, *, settled: bool = True
    ) -> None:
        self.motion, self.friction, self.effect, self._settled = motion, friction, effect, settled
        self._tangents: tuple[bytes, _Tangents] | None = None

    @cached_property
    def _at_step(self) -> _Level:
        return _Level(self.motion.step_speed, self.friction, _at_step(self.effect, self.motion))

    @cached_property
    def _at_row(self) -> _Level:
        return _Level(self.motion.speed, self.friction, self.effect)

    @cached_property
    def furthest_bend(self) -> Array:
        """How far the bristle can bend where it starts, rad (m), shape (starts,): to the level of standstill,
        or to that of the motion which it may come from, as the effects change them there."""
        friction, effect = self.friction, self.effect
        begins = self.motion.begins

        def there(term: Term) -> Term:
            return term[begins] if isinstance(term, np.ndarray) else term

        level = np.maximum(friction.static * (1.0 + there(effect.static_change)), friction.coulomb)
        level = level * (1.0 + there(effect.level_change)) + there(effect.level_torque)
        return np.asarray(np.maximum(level, self._at_row.value[begins])) / friction.bristle_stiffness

    @cached_property
    def _along(self) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
        rho = self.friction.bristle_stiffness / self._at_step.value
        return self.motion.step_velocity, self.motion.step, rho, self.motion.first

    @cached_property
    def _slid(self) -> tuple[Array, Array]:
        """Share of the bristle that slid in the step that ends at each row, and x (`lugre`); nothing of one
        that is not to settle."""
        if not self._settled:
            nothing = np.zeros(len(self.motion))
            return nothing, nothing
        _, step, rho, _ = self._along
        pace = rho * self.motion.step_speed
        pace *= step
        return -np.expm1(-pace), pace

    @cached_property
    def _settling(self) -> Array:
        """How much further the bristle is bent at each row than at its step's mean level.

        What slid in the step is bent to the level of the step's end, not to that of its mean: where the level
        changes much within a step, dz/dt at the row would otherwise follow from a bend of another speed.
        """
        slid, _ = self._slid
        level = (self._at_row.value - self._at_step.value) / self.friction.bristle_stiffness
        return np.asarray(self.motion.way * slid * level)

    @cached_property
    def _rho_speed(self) -> Array:
        return np.asarray(self.friction.bristle_stiffness / self._at_row.value * self.motion.speed)

    @cached_property
    def _through_z(self) -> Array:
        friction, passed = self.friction, 1.0 + self.effect.bristle_change
        return np.asarray(passed * (friction.bristle_stiffness - friction.bristle_damping * self._rho_speed))

    def predict(self, start: Array) -> Prediction:
        """As the function of that name."""
        z, decay = lugre.propagate(*self._along, start, self.motion.restart)
        torque, start_column = self._plain(z + self._settling, decay)
        finished = Finished(self.motion, self.effect, torque, start_column)
        return Prediction(finished.torque, finished.start_column, z)

    def linearise(self, start: Array, directions: Sequence[Direction]) -> tuple[Prediction, Iterator[Array]]:
        """As the function of that name, derivatives `BLOCK` at a time, shape (BLOCK, rows), each in the place
        of those before; the last ones may be of nothing."""
        key = start.tobytes()
        if self._tangents is None or self._tangents[0] != key:
            self._tangents = key, self._propagated(start)
        known = self._tangents[1]
        along = [direction.effect for direction in directions]
        finished = Finished(self.motion, self.effect, known.torque, known.start_column, along)
        prediction = Prediction(finished.torque, finished.start_column, known.z)
        return prediction, self._blocks(known, finished, directions)

    def _propagated(self, start: Array) -> _Tangents:
        z, decay, tangent = lugre.propagate_blocks(*self._along, start, self.motion.restart)
        bent = z + self._settling
        z_rate = self.motion.velocity - self._rho_speed * bent
        passed = 1.0 + self.effect.bristle_change
        slid, pace = self._slid
        sliding = self.motion.way / self.friction.bristle_stiffness * self._through_z
        at_row, at_step = self._at_row.value, self._at_step.value
        through_row = passed * (self.friction.bristle_damping * self._rho_speed * bent)
        through_row += sliding * slid * at_row
        through_step = sliding * (slid * at_step + (1.0 - slid) * pace * (at_row - at_step))
        return _Tangents(*self._plain(bent, decay), z, tangent, bent, z_rate, through_row, through_step)

    def _blocks(
        self, known: _Tangents, finished: Finished, directions: Sequence[Direction]
    ) -> Iterator[Array]:
        """The derivatives of the finished torque."""
        columns, dlog_rho = np.zeros((2, BLOCK, len(self.motion)))
        for begin in range(0, len(directions), BLOCK):
            some = directions[begin : begin + BLOCK]
            bent = False
            for column, over_step, direction in zip(columns, dlog_rho, some, strict=False):
                column[:] = 0.0
                self._beside_the_state(known, direction, column)
                if not direction.bends_bristle():
                    over_step[:] = 0.0
                    continue
                along, bent = direction.effect, True
                self._at_step.dlog_rho(direction, _at_step(along, self.motion), self.friction, over_step)
                at_row = self._at_row.dlog_rho(direction, along, self.friction)
                _add_levels(column, known.through_row, at_row, known.through_step, over_step)
            if bent:
                known.tangent(dlog_rho, self._through_z, columns)
            if finished.acts:
                for column, direction in zip(columns, some, strict=False):
                    column[:] = finished.derivative(column, direction.effect)
            yield columns

    def _beside_the_state(self, known: _Tangents, direction: Direction, column: Array) -> None:
        """Add the derivative of the torque at a bristle's state, but for that of the friction level."""
        motion, friction, effect = self.motion, self.friction, self.effect
        passed, z, z_rate = 1.0 + effect.bristle_change, known.bent, known.z_rate
        along = direction.effect
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

    def _plain(self, bent: Array, decay: Array) -> tuple[Array, Array]:
        """The torque at a deflection `bent`, before what acts on the finished one, and its start column."""
        friction, effect, velocity = self.friction, self.effect, self.motion.velocity
        torque = self._through_z * bent
        torque += (1.0 + effect.bristle_change) * friction.bristle_damping * velocity
        torque += friction.viscous * (1.0 + effect.viscous_change) * velocity
        torque += effect.torque
        return torque, self._through_z * decay


@jit()
def _add_levels(
    column: Array, through_row: Array, at_row: Array, through_step: Array, over_step: Array
) -> None:
    for k in range(len(column)):
        column[k] = column[k] - through_row[k] * at_row[k] + through_step[k] * over_step[k]


@dataclass(frozen=True)
class _Tangents:
    """What derivatives of the bristle take, from one start deflection.

    Attributes:
        torque, start_column: as in `Prediction`, before what acts on the finished torque.
        z: deflection that the next step starts from, shape (rows,).
        tangent: see `lugre.propagate_blocks`.
        bent: deflection at the row, shape (rows,), and its rate `z_rate`.
        through_row: what a change of ln(rho) at the row takes off, shape (rows,).
        through_step: what one over the step adds beside the state's, shape (rows,).
    """

    torque: Array
    start_column: Array
    z: Array
    tangent: Callable[[Array, Array, Array], None]
    bent: Array
    z_rate: Array
    through_row: Array
    through_step: Array


class _Level:
    """g over rows or steps, and the derivative of ln(sigma0 / g)."""

    def __init__(self, speed: Array, friction: Friction, effect: Contribution) -> None:
        # in place, and nothing that changes nothing: a fit spends a quarter of its time here
        self.exponent = EXPONENT + effect.exponent_change
        self.ratio = speed / friction.stribeck_velocity
        self.power = (
            self.ratio * self.ratio
            if isinstance(self.exponent, float) and self.exponent == 2.0
            else (self.ratio**self.exponent)
        )
        self.fade = np.negative(self.power)
        np.exp(self.fade, out=self.fade)
        self.static = friction.static * (1.0 + effect.static_change)
        self.plain = (self.static - friction.coulomb) * self.fade
        self.plain += friction.coulomb
        self.scale = 1.0 + effect.level_change
        value = self.plain
        if not is_zero(effect.level_change):
            value = value * self.scale
        if not is_zero(effect.level_torque):
            value = value + effect.level_torque
        self.value: Array = np.maximum(value, least_level(friction.coulomb, friction.static))

    def dlog_rho(
        self, direction: Direction, effect: Contribution, friction: Friction, out: Array | None = None
    ) -> Array:
        """Derivative of ln(sigma0 / g) along `direction`, whose effect part is `effect`, shape (rows,)."""
        out = np.empty(len(self.value)) if out is None else out
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
        if not is_zero(change) and not isinstance(self.scale, float):
            change = self.scale * change
        if not is_zero(effect.level_change):
            change = change + self.plain * effect.level_change
        if not is_zero(effect.level_torque):
            change = change + effect.level_torque
        stiff = direction.bristle_stiffness / friction.bristle_stiffness
        if is_zero(change):
            out[:] = stiff
            return out
        np.divide(change, self.value, out=out)
        return np.subtract(stiff, out, out=out)


def _at_step(effect: Contribution, motion: Motion) -> Contribution:
    """The level terms of a contribution, averaged over each step."""
    terms = {name: getattr(effect, name) for name in effect.places if name in _OF_LEVEL}
    return Contribution(
        **{name: motion.at_step(t) if isinstance(t, np.ndarray) else t for name, t in terms.items()}
    )
