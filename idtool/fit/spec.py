"""Which model a joint fit is of, and the sizes of the data from which its bounds follow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from idtool.effects.base import Effect
from idtool.signals import Recording
from idtool.signals.coverage import slowest_speed

FrictionKind = Literal["lugre", "stribeck", "coulomb"]
FRICTION_KINDS: tuple[FrictionKind, ...] = ("lugre", "stribeck", "coulomb")
#: The fall to the Coulomb level is over (down to exp(-2)) at the top speed: a level that was not reached is
#: none that the data show, and a wider curve stands for any friction that grows or fades with the speed.
_WIDEST_CURVE = 2.0**-0.5


@dataclass(frozen=True)
class Spec:
    """Which model: the friction law, the gravity model and the effects.

    Attributes:
        friction: "lugre", "stribeck" (static curve only) or "coulomb" (Coulomb + viscous).
        gravity: "slide", "arm" or None.
        gravity_columns: which of the two gravity coefficients the data can show.
        effects: in the order in which they were accepted.
        soft: whether the bristle may bend over more than a small share of the stroke (the paper's does). It
            can then stand for a spring, an offset or gravity, so that has to be earned.
        falling: whether the static level is the Coulomb level at least, as nearly every contact has it. A
            curve that rises from rest can make up for an effect that the model lacks.
    """

    friction: FrictionKind
    gravity: str | None
    gravity_columns: tuple[str, ...]
    effects: tuple[Effect, ...] = ()
    soft: bool = False
    falling: bool = False

    def adding(self, effect: Effect) -> Spec:
        """The same with one more effect, in place of those that are special cases of it."""
        replaced = (effect.name, *effect.absorbs)
        kept = tuple(other for other in self.effects if other.name not in replaced)
        return replace(self, effects=(*kept, effect))

    def without(self, name: str) -> Spec:
        """The same without an effect."""
        kept = tuple(effect for effect in self.effects if effect.name != name)
        return replace(self, effects=kept)


@dataclass(frozen=True)
class Scales:
    """Typical sizes of the data, from which bounds follow.

    Attributes:
        torque: friction-sized torque.
        speed: highest speed.
        slowest: lowest speed at which the axis moved steadily.
        travel: total stroke.
        resolution: smallest step of the position.
    """

    torque: float
    speed: float
    slowest: float
    travel: float
    resolution: float

    @classmethod
    def of(cls, recording: Recording) -> Scales:
        """Measure them."""
        motion = recording.motion
        speed = np.abs(motion.velocity)
        top = float(np.quantile(speed, 0.999))
        # a pass over the rows each, however many trials there are
        within = np.maximum.reduceat(motion.position, motion.starts) - np.minimum.reduceat(
            motion.position, motion.starts
        )
        spread = float(np.std(recording.filtered_torque / recording.row_weight)) + recording.noise
        return cls(
            torque=spread,
            speed=max(top, 1e-9),
            slowest=max(slowest_speed(recording), 1e-9),
            travel=max(float(np.max(within)), 1e-9),
            resolution=recording.position_resolution,
        )

    @property
    def widest_curve(self) -> float:
        """Stribeck velocity above which the Coulomb level is not reached."""
        return max(_WIDEST_CURVE * self.speed, self.slowest)

    @property
    def shortest_bend(self) -> float:
        """Presliding travel below which the position shows nothing of the bristle."""
        return max(3.0 * self.resolution, 1e-5 * self.travel)
