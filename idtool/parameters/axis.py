"""What the logs and the parameter file say about the axis itself."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from idtool.errors import InputError, misspelt, nearest
from idtool.io.toml import is_finite, short
from idtool.model.units import Kind, file_key


@dataclass(frozen=True)
class Axis:
    """The `[axis]` table.

    Attributes:
        kind: "rotary" or "linear".
        torque_constant: K, N m/A (rotary) or N/A (linear); None where the logs hold torque itself.
        extra: any other key of the table, kept as it was read.
    """

    kind: Kind = "rotary"
    torque_constant: float | None = None
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def constant_key(self) -> str:
        """`torque_constant_nm_per_a` or `force_constant_n_per_a`."""
        return constant_key(self.kind)

    def key(self, name: str, dimension: str) -> str:
        """The file key of a quantity on this axis."""
        return file_key(name, dimension, self.kind)

    def to_table(self) -> dict[str, Any]:
        """The TOML table."""
        table: dict[str, Any] = {"kind": self.kind}
        if self.torque_constant is not None:
            table[self.constant_key] = self.torque_constant
        return table | self.extra

    def completed(self, known: Axis, *, file: Any = None) -> Axis:
        """This axis with what only `known` says of it; `file` is where this one was read.

        Raises:
            InputError: they contradict each other.
        """
        mine, theirs = self.torque_constant, known.torque_constant
        if self.kind != known.kind or (
            mine is not None and theirs is not None and not math.isclose(mine, theirs, rel_tol=1e-9)
        ):
            raise InputError(
                "is of another axis than the axis file (kind or torque constant differs)",
                file=file,
                place="[axis]",
                remedy="name the file of this axis",
            )
        return Axis(self.kind, theirs if mine is None else mine, {**known.extra, **self.extra})

    @classmethod
    def from_table(cls, table: Any, *, file: Any = None) -> Axis:
        """Read and check an `[axis]` table.

        Raises:
            InputError: unknown kind, or a torque constant that is not a finite positive number.
        """
        if not isinstance(table, dict):
            raise InputError("axis is not a table", file=file, place="[axis]", remedy="write it as [axis]")
        kind = table.get("kind", "rotary")
        if kind not in ("rotary", "linear"):
            raise InputError(
                f"unknown kind of axis {short(kind)}",
                file=file,
                place="axis.kind",
                remedy=nearest(str(kind), ["rotary", "linear"]),
            )
        wanted = constant_key(kind)
        other = constant_key("linear" if kind == "rotary" else "rotary")
        if other in table:
            raise InputError(
                f"{other} does not fit a {kind} axis",
                file=file,
                place=f"axis.{other}",
                remedy=f"use {wanted}",
            )
        if wrong := misspelt(("kind", wanted), table):
            raise InputError(
                "unknown key", file=file, place=f"axis.{wrong[0]}", remedy=f'did you mean "{wrong[1]}"'
            )
        constant = table.get(wanted)
        if constant is not None:
            constant = check_constant(constant, file=file, place=f"axis.{wanted}")
        extra = {key: value for key, value in table.items() if key not in ("kind", wanted)}
        return cls(kind, constant, extra)


def constant_key(kind: str) -> str:
    """The key of the torque constant in a file, per kind of axis."""
    return "force_constant_n_per_a" if kind == "linear" else "torque_constant_nm_per_a"


def check_constant(
    value: Any, *, file: Any = None, place: str | None = None, argument: str | None = None
) -> float:
    """A torque constant, checked.

    Raises:
        InputError: not a finite number above zero.
    """
    if not is_finite(value) or value <= 0:
        raise InputError(
            f"the torque constant must be a finite number above zero, not {short(value)}",
            file=file,
            place=place,
            argument=argument,
            remedy="take it from the servo's data sheet (stall torque / stall current)",
        )
    return float(value)
