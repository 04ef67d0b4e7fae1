"""The axis file: what is known of an axis before anything was measured on it.

    schema = "ffc-id/axis/1"

    [axis]
    kind = "rotary"
    torque_constant_nm_per_a = 2.67
    unit = "elbow 3"

    [limits]
    lowest_rad = -1.5
    highest_rad = 1.5
    speed_rad_s = 1.0
    current_a = 1.2

It stands in for what logs without a header do not say, and sets the limits of a servo. A linear axis has
`force_constant_n_per_a`, `lowest_m`, `highest_m` and `speed_m_s`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from idtool.errors import InputError, in_file
from idtool.io.atomic import atomic_write, refuse_existing
from idtool.io.tables import check_schema, no_strangers, table_at
from idtool.io.toml import is_finite, load_toml, short
from idtool.model.units import Kind, file_key
from idtool.parameters.axis import Axis

SCHEMA = "ffc-id/axis/1"
#: name of a limit -> its dimension
LIMITS: dict[str, str] = {
    "lowest": "position",
    "highest": "position",
    "speed": "velocity",
    "current": "current",
}
_POSITIVE = ("speed", "current")


@dataclass(frozen=True)
class AxisFile:
    """What the file says.

    Attributes:
        axis: kind, torque constant and, in `extra`, whatever else `[axis]` holds (`unit`, its name).
        limits: "lowest", "highest" (rad or m), "speed" (rad/s or m/s), "current" (A), those that are given.
    """

    axis: Axis
    limits: dict[str, float] = field(default_factory=dict)

    def to_document(self) -> dict[str, Any]:
        """The TOML document."""
        document: dict[str, Any] = {"schema": SCHEMA, "axis": self.axis.to_table()}
        if self.limits:
            keys = _keys(self.axis.kind)
            document["limits"] = {key: self.limits[name] for key, name in keys.items() if name in self.limits}
        return document

    def write(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the file whole or not at all.

        Raises:
            InputError: `path` exists and `force` is not given, it cannot be written, or `read` would not
                take what is in it.
        """
        file = Path(path)
        refuse_existing(file, force)
        document = self.to_document()
        with in_file(file):
            AxisFile.from_document(document)
        with atomic_write(file) as stream:
            stream.write(tomli_w.dumps(document))

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> AxisFile:
        """Read and check an axis file.

        Raises:
            InputError: naming the file, the key and what was expected.
        """
        file = Path(path)
        with in_file(file):
            return cls.from_document(load_toml(file, what="an axis file", made_by="`ffc-id init`"))

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> AxisFile:
        """Check a TOML document."""
        check_schema(document, SCHEMA, f'an axis file has schema = "{SCHEMA}"; ffc-id init writes one')
        no_strangers(document, ("schema", "axis", "limits"), "")
        if "axis" not in document:
            raise InputError("is missing", place="[axis]", remedy="add [axis] with its kind")
        axis = Axis.from_table(document["axis"])
        return cls(axis, _limits(document.get("limits", {}), axis.kind))


def _keys(kind: Kind) -> dict[str, str]:
    """Key in the file -> name of the limit."""
    return {file_key(name, dimension, kind): name for name, dimension in LIMITS.items()}


def _limits(table: Any, kind: Kind) -> dict[str, float]:
    keys = _keys(kind)
    no_strangers(table_at(table, "limits"), keys, "limits.")
    limits = {}
    for key, value in table.items():
        positive = keys[key] in _POSITIVE
        if not is_finite(value) or (positive and value <= 0):
            raise InputError(
                f"expected a finite number{' above zero' if positive else ''}, found {short(value)}",
                place=f"limits.{key}",
                remedy="correct it",
            )
        limits[keys[key]] = float(value)
    if limits.get("lowest", -1e300) >= limits.get("highest", 1e300):
        raise InputError(
            "the lowest position is not below the highest",
            place=f"limits.{file_key('lowest', 'position', kind)}",
            remedy="swap them",
        )
    return limits
