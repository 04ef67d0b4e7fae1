"""What the logs and the parameter file say about the axis itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from idtool.errors import InputError, misspelt, nearest
from idtool.io.toml import is_finite, short
from idtool.model.units import EffortUnit, Kind, Units, file_key, units_of


@dataclass(frozen=True)
class Axis:
    """The `[axis]` table.

    Attributes:
        kind: "rotary" or "linear".
        torque_constant: K, N m/A (rotary) or N/A (linear); None where the logs hold torque itself, or where
            nobody knows it.
        extra: any other key of the table, kept as it was read.
        torque_per_volt: K / R, N m/V (rotary) or N/V (linear): the torque of a motor that stands, for each
            volt at it; None where it is not known.
        resistance: R of the winding, ohm, with which the back-EMF is split off; None where it is not known.
        effort: what the numbers of a parameter file are counted in: "torque", or "current" (A) and
            "voltage" (V) where no constant leads to N m.
    """

    kind: Kind = "rotary"
    torque_constant: float | None = None
    extra: dict[str, Any] = field(default_factory=dict)
    torque_per_volt: float | None = None
    resistance: float | None = None
    effort: EffortUnit = "torque"

    @property
    def units(self) -> Units:
        """The kind of axis and what its effort is counted in, as names of quantities need it."""
        return units_of(self.kind, self.effort)

    @property
    def voltage_constant(self) -> float | None:
        """N m/V: `torque_per_volt`, or the torque constant over the resistance where both are known."""
        if self.torque_per_volt is None and self.torque_constant and self.resistance:
            return self.torque_constant / self.resistance
        return self.torque_per_volt

    @property
    def back_emf_damping(self) -> float:
        """K^2 / R, N m s/rad, by which the back-EMF brakes a motor at a voltage; 0 where R is not known."""
        per_volt = self.voltage_constant
        return 0.0 if per_volt is None or self.resistance is None else per_volt**2 * self.resistance

    @property
    def reading(self) -> Literal["current", "voltage"]:
        """What stands for the motor's torque sample by sample: its current, A, or the voltage at it, V."""
        if self.torque_constant is None and (self.voltage_constant is not None or self.effort == "voltage"):
            return "voltage"
        return "current"

    @property
    def per_reading(self) -> float | None:
        """What leads from that reading to the effort of the file; None where nobody knows it."""
        known = self.voltage_constant if self.reading == "voltage" else self.torque_constant
        return known if self.effort == "torque" else 1.0

    @property
    def constant_key(self) -> str:
        """`torque_constant_nm_per_a` or `force_constant_n_per_a`."""
        return constant_key(self.kind)

    def key(self, name: str, dimension: str) -> str:
        """The file key of a quantity on this axis."""
        return file_key(name, dimension, self.units)

    def to_table(self) -> dict[str, Any]:
        """The TOML table."""
        table: dict[str, Any] = {"kind": self.kind}
        if self.torque_constant is not None:
            table[self.constant_key] = self.torque_constant
        if self.torque_per_volt is not None:
            table[voltage_key(self.kind)] = self.torque_per_volt
        if self.resistance is not None:
            table["resistance_ohm"] = self.resistance
        if self.effort != "torque":
            table["effort"] = self.effort
        return table | self.extra

    def completed(self, known: Axis) -> Axis:
        """This axis with what only `known` says of it.

        Raises:
            InputError: they contradict each other.
        """
        if not self.agrees(known):
            raise InputError(
                "is of another axis than the axis file (kind or torque constant differs)",
                place="[axis]",
                remedy="name the file of this axis",
            )
        mine = {name: getattr(self, name) for name in _NUMBERS}
        numbers = {name: getattr(known, name) if mine[name] is None else mine[name] for name in _NUMBERS}
        return replace(self, extra={**known.extra, **self.extra}, **numbers)

    def agrees(self, other: Axis) -> bool:
        """Whether two tables can be of one axis: of one kind, and no number that both give differs."""
        pairs = [(getattr(self, name), getattr(other, name)) for name in _NUMBERS]
        return self.kind == other.kind and all(
            a is None or b is None or math.isclose(a, b, rel_tol=1e-9) for a, b in pairs
        )

    @classmethod
    def from_table(cls, table: Any) -> Axis:
        """Read and check an `[axis]` table.

        Raises:
            InputError: unknown kind, or a torque constant that is not a finite positive number.
        """
        if not isinstance(table, dict):
            raise InputError("axis is not a table", place="[axis]", remedy="write it as [axis]")
        kind = table.get("kind", "rotary")
        if kind not in ("rotary", "linear"):
            raise InputError(
                f"unknown kind of axis {short(kind)}",
                place="axis.kind",
                remedy=nearest(str(kind), ["rotary", "linear"]),
            )
        keys = {"torque_constant": constant_key(kind), "torque_per_volt": voltage_key(kind)}
        keys["resistance"] = "resistance_ohm"
        elsewhere = "linear" if kind == "rotary" else "rotary"
        for key_of in (constant_key, voltage_key):
            if (other := key_of(elsewhere)) in table:
                raise InputError(
                    f"{other} does not fit a {kind} axis", place=f"axis.{other}", remedy=f"use {key_of(kind)}"
                )
        known = ("kind", *keys.values(), "effort")
        missing = [key for key in known if key not in table]
        if wrong := misspelt(missing, [key for key in table if key not in known]):
            raise InputError("unknown key", place=f"axis.{wrong[0]}", remedy=f'did you mean "{wrong[1]}"')
        numbers = {
            name: check_constant(table[key], _CALLED[name], place=f"axis.{key}")
            for name, key in keys.items()
            if table.get(key) is not None
        }
        effort = table.get("effort", "torque")
        if effort not in ("torque", "current", "voltage"):
            raise InputError(
                f"unknown effort {short(effort)}",
                place="axis.effort",
                remedy=nearest(str(effort), ["torque", "current", "voltage"]),
            )
        extra = {key: value for key, value in table.items() if key not in known}
        return cls(kind, extra=extra, effort=effort, **numbers)


#: Numbers of a motor, N m/A, N m/V or ohm: a piezo drive and a mill are well within.
_LEAST, _MOST = 1e-9, 1e9
#: The numbers of the table, and what they are called.
_CALLED = {
    "torque_constant": "the torque constant",
    "torque_per_volt": "the torque per volt",
    "resistance": "the resistance",
}
_NUMBERS = tuple(_CALLED)


def constant_key(kind: str) -> str:
    """The key of the torque constant in a file, per kind of axis."""
    return "force_constant_n_per_a" if kind == "linear" else "torque_constant_nm_per_a"


def voltage_key(kind: str) -> str:
    """The key of the torque per volt in a file, per kind of axis."""
    return "force_per_volt_n_per_v" if kind == "linear" else "torque_per_volt_nm_per_v"


def check_constant(
    value: Any, what: str = "the torque constant", *, place: str | None = None, argument: str | None = None
) -> float:
    """A torque constant or another number of a motor, checked.

    Raises:
        InputError: not a finite number above zero, or none of a machine.
    """
    if is_finite(value) and value > 0 and not _LEAST <= value <= _MOST:
        raise InputError(
            f"{what} is {value:g}, which no motor has (expected {_LEAST:g} to {_MOST:g})",
            place=place,
            argument=argument,
            remedy="look for a slip of the power of ten",
        )
    if not is_finite(value) or value <= 0:
        raise InputError(
            f"{what} must be a finite number above zero, not {short(value)}",
            place=place,
            argument=argument,
            remedy="take it from the servo's data sheet (stall torque / stall current)"
            if what == _CALLED["torque_constant"]
            else "take it from the servo's data sheet",
        )
    return float(value)
