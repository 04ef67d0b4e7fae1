"""Shapes without a name that compete with the effects for the same evidence.

A bump at one place has Fourier components, and each of them looks like a ripple. No rule can tell the two
from the ripple's gain alone; but a bump explains a bump better than any ripple does, with fewer numbers. So
local shapes over position, speed and time are scored, refitted and accepted like effects. One that wins is
no explanation: it keeps what it stands for from being explained falsely, it is taken out of the model at the
end, and what it followed is called unexplained.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import ClassVar, final

import numpy as np

from idtool.effects.base import Coordinate, Effect, EffectParameter, Values
from idtool.fit.joint import JointFit, added_by
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion
from idtool.model.units import unit_text

#: Places, and widths as shares of the range, from which a search starts.
_PLACES = 32
_WIDTHS = (0.01, 0.025, 0.06)
#: Dimension of each variable, and what a shape is a function of.
_VARIABLES: dict[str, tuple[str, Callable[[Array], Array]]] = {
    "position": ("position", np.asarray),
    "velocity": ("velocity", np.abs),
    "load": ("torque", np.abs),
    "time": ("time", np.asarray),
}
#: A wider bump is a smooth shape, which the library has.
_WIDEST = 0.1


class Unnamed(Effect):
    """A local shape over one variable: a torque, or more friction.

    Attributes:
        of_friction: whether it is added to the level of friction, which the bristle passes on.
        preposition: the word before its place.
    """

    of_friction: ClassVar[bool]
    preposition: ClassVar[str] = "at"
    formula = "one place of the variable, and nothing elsewhere"
    reveals = ""
    citation = "none: it has no name"
    parameters: ClassVar[tuple[EffectParameter, ...]] = ()
    coordinates = (
        Coordinate("height"),
        Coordinate("place", increment=1e-4),
        Coordinate("log_width", null=-3.0, increment=1e-4),
    )

    def variable(self, motion: Motion) -> Array:
        """What it is a function of, shape (rows,)."""
        values = getattr(motion, self.follows[0])
        return np.zeros(len(motion)) if values is None else np.asarray(_VARIABLES[self.follows[0]][1](values))

    def shape(self, variable: Array, place: float, log_width: float) -> Array:
        """One at its place."""
        return np.asarray(np.exp(-0.5 * ((variable - place) / np.exp(log_width)) ** 2))

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        torque = values["height"] * self.shape(self.variable(motion), values["place"], values["log_width"])
        return Contribution(level_torque=torque) if self.of_friction else Contribution(torque=torque)

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
        """The range of the variable in which it can be: what has no flank on one side is a smooth shape, or a
        friction curve, which the library has."""
        values = self.variable(motion)
        low, high = float(np.min(values)), float(np.max(values))
        inside = _WIDEST * (high - low)
        return low + inside, high - inside

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

    def told(self, fit: JointFit, least: float) -> str:
        """What it looks like, in words; nothing where it comes to less than a torque on every row.

        Its size is the most that it adds to the torque of a row that is compared: none need show the height
        of one that lies beyond them, nor that of friction where nothing slides.
        """
        recording = fit.model.recording
        added = np.abs(added_by(fit, self)[recording.row])
        at = int(np.argmax(added))
        if added[at] < least:
            return ""
        values, units = fit.model.effect_values(fit.x, self), recording.axis.units
        size = f"{math.copysign(added[at], values['height']):+.2g} {unit_text('torque', units)}"
        seen = self.seen_at(self.variable(recording.motion)[recording.row], at, values)
        place = f"{seen:.3g} {unit_text(_VARIABLES[self.follows[0]][0], units)}"
        return f"{self.title.lower()}: {size} {self.preposition} {place}"

    def seen_at(self, variable: Array, most: int, values: Values) -> float:
        """Where it is, as rows show it: where they show most, which is one of them."""
        return float(variable[most])

    def near(self, motion: Motion, start: Values, share: float) -> list[dict[str, float]]:
        """A start and those around it, a share of its width apart."""
        _, place, log_width = self.active(motion)
        step = share * float(np.exp(start["log_width"]))
        return [
            {
                "place": float(np.clip(start["place"] + aside * step, place.lower, place.upper)),
                "log_width": float(
                    np.clip(start["log_width"] + wider * share, log_width.lower, log_width.upper)
                ),
            }
            for aside in (-1.0, 0.0, 1.0)
            for wider in (-1.0, 0.0, 1.0)
        ]

    def untestable(self, motion: Motion) -> str | None:
        low, high = self.ends(motion)
        return None if high > low else "it does not change"


class _Step(Unnamed):
    """From one value of the variable on."""

    preposition = "from"

    def shape(self, variable: Array, place: float, log_width: float) -> Array:
        return np.asarray(0.5 + 0.5 * np.tanh((variable - place) / np.exp(log_width)))

    def seen_at(self, variable: Array, most: int, values: Values) -> float:
        """Its place, or before it where half of what rows show of it is reached."""
        shape = self.shape(variable, values["place"], values["log_width"])
        return min(values["place"], float(np.min(variable[shape >= 0.5 * np.max(shape)])))


@final
class BumpInPosition(Unnamed):
    name, title = "unnamed_bump_in_position", "Bump over the position"
    follows, of_friction = ("position",), False


@final
class GripInPosition(Unnamed):
    name, title = "unnamed_grip_in_position", "Friction at one place"
    follows, of_friction = ("position",), True


@final
class BumpInSpeed(Unnamed):
    name, title = "unnamed_bump_in_speed", "Friction at one speed"
    follows, of_friction = ("velocity",), True

    def ends(self, motion: Motion) -> tuple[float, float]:
        """From rest on, where it is what no friction curve of the library follows."""
        return 0.0, super().ends(motion)[1]


@final
class GripUnderLoad(_Step):
    name, title = "unnamed_grip_under_load", "Friction that sets in under load"
    follows, of_friction = ("load",), True


@final
class StepInTime(_Step):
    name, title = "unnamed_step_in_time", "Step in time"
    follows, of_friction = ("time",), False


@final
class WearInTime(_Step):
    name, title = "unnamed_wear_in_time", "Friction that changes at once"
    follows, of_friction = ("time",), True


UNNAMED: tuple[Unnamed, ...] = (
    BumpInPosition(),
    GripInPosition(),
    BumpInSpeed(),
    GripUnderLoad(),
    StepInTime(),
    WearInTime(),
)
