"""Shapes without a name that compete with the effects for the same evidence.

A bump at one place has Fourier components, and each of them looks like a ripple. No rule can tell the two
from the ripple's gain alone; but a bump explains a bump better than any ripple does, with fewer numbers. So
local shapes over position, speed and time are scored, refitted and accepted like effects. One that wins is
no explanation: it keeps what it stands for from being explained falsely, it is taken out of the model at the
end, and what it followed is called unexplained.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion

#: Places, and widths as shares of the range, from which a search starts.
_PLACES = 32
_WIDTHS = (0.01, 0.025, 0.06)
#: A wider bump is a smooth shape, which the library has.
_WIDEST = 0.1


class Unnamed(Effect):
    """A local shape over one variable: a torque, or one that turns with the motion as friction does.

    Attributes:
        with_motion: whether it turns with the motion.
    """

    with_motion: ClassVar[bool]
    formula = "one place of the variable, and nothing elsewhere"
    reveals = ""
    citation = "none: it has no name"
    parameters: ClassVar[tuple[EffectParameter, ...]] = ()
    coordinates = (Coordinate("height"), Coordinate("place"), Coordinate("log_width", null=-3.0))

    @abstractmethod
    def variable(self, motion: Motion) -> Array:
        """What it is a function of, shape (rows,)."""

    def shape(self, variable: Array, place: float, log_width: float) -> Array:
        """One at its place."""
        return np.asarray(np.exp(-0.5 * ((variable - place) / np.exp(log_width)) ** 2))

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        torque = values["height"] * self.shape(self.variable(motion), values["place"], values["log_width"])
        return Contribution(torque=torque * np.sign(motion.velocity) if self.with_motion else torque)

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        low, high = self.ends(motion)
        height, _, _ = self.coordinates
        narrowest, widest = np.log([0.3 * _WIDTHS[0] * (high - low), _WIDEST * (high - low)])
        return (
            height,
            Coordinate("place", lower=low, upper=high, increment=1e-4 * (high - low)),
            Coordinate("log_width", null=-3.0, lower=narrowest, upper=widest, increment=1e-4),
        )

    def ends(self, motion: Motion) -> tuple[float, float]:
        """The range of the variable."""
        values = self.variable(motion)
        return float(np.min(values)), float(np.max(values))

    def starts(self, motion: Motion) -> list[dict[str, float]]:
        low, high = self.ends(motion)
        return [
            {
                "place": low + (place + 0.5) / _PLACES * (high - low),
                "log_width": float(np.log(width * (high - low))),
            }
            for width in _WIDTHS
            for place in range(_PLACES)
        ]

    def untestable(self, motion: Motion) -> str | None:
        low, high = self.ends(motion)
        return None if high > low else "it does not change"


@final
class BumpInPosition(Unnamed):
    name, title, follows, with_motion = (
        "unnamed_bump_in_position",
        "Bump over the position",
        ("position",),
        False,
    )

    def variable(self, motion: Motion) -> Array:
        return motion.position


@final
class GripInPosition(Unnamed):
    name, title, follows, with_motion = "unnamed_grip_in_position", "Grip at one place", ("position",), True

    def variable(self, motion: Motion) -> Array:
        return motion.position


@final
class BumpInSpeed(Unnamed):
    name, title, follows, with_motion = "unnamed_bump_in_speed", "Bump at one speed", ("velocity",), True

    def variable(self, motion: Motion) -> Array:
        return np.abs(motion.velocity)


class _Step(Unnamed):
    """From one instant on."""

    def variable(self, motion: Motion) -> Array:
        return motion.time

    def shape(self, variable: Array, place: float, log_width: float) -> Array:
        return np.asarray(0.5 + 0.5 * np.tanh((variable - place) / np.exp(log_width)))


@final
class StepInTime(_Step):
    name, title, follows, with_motion = "unnamed_step_in_time", "Step in time", ("time",), False


@final
class WearInTime(_Step):
    name, title, follows, with_motion = (
        "unnamed_wear_in_time",
        "Friction that changes at once",
        ("time",),
        True,
    )


UNNAMED: tuple[Unnamed, ...] = (BumpInPosition(), GripInPosition(), BumpInSpeed(), StepInTime(), WearInTime())
