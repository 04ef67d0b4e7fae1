"""What one shown row holds."""

from __future__ import annotations

import math
from dataclasses import dataclass

from idtool.model.units import Kind, Units, unit_suffix, unit_text
from idtool.rig.base import Measured, Rig


@dataclass(frozen=True)
class Row:
    """The quantities of a row, in the order in which they are shown after the time.

    Attributes:
        kind: of axis.
        measures: what stands for the motor's torque.
        constant: N m (N) per A, or per V where that is measured; None where nobody knows it.
    """

    kind: Kind
    measures: Measured
    constant: float | None

    @classmethod
    def of(cls, rig: Rig) -> Row:
        """What a rig gives."""
        axis = rig.axis
        return cls(axis.kind, rig.measures, axis.per_reading if axis.reading == rig.measures else None)

    @property
    def _dimensions(self) -> list[tuple[str, str, Units]]:
        own: Units = "rotary_a" if self.measures == "current" else "rotary_v"
        motor = "motor_torque" if self.kind == "rotary" else "motor_force"
        return [
            ("position", "position", self.kind),
            (self.measures, "torque", own),
            (motor, "torque", self.kind),
            ("hand", "torque", self.kind),
        ]

    @property
    def names(self) -> list[tuple[str, str]]:
        """Name and unit of each, for a person."""
        return [(name.replace("_", " "), unit_text(what, units)) for name, what, units in self._dimensions]

    @property
    def keys(self) -> list[str]:
        """Each as a log's column would be called."""
        return [f"{name}_{unit_suffix(what, units)}" for name, what, units in self._dimensions]

    def values(self, position: float, effort: float, hand: float) -> tuple[float | None, ...]:
        """Their values; None where one is not known."""
        torque = None if self.constant is None else self.constant * effort
        return position, effort, torque, None if math.isnan(hand) else hand
