"""The parameters of a file as rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from idtool.effects import registry
from idtool.model.units import unit_text
from idtool.parameters.contents import DYNAMIC, GRAVITY_MODELS, STATIC
from idtool.parameters.drive import dimensions as drive_dimensions
from idtool.parameters.parameter import Parameter

if TYPE_CHECKING:
    from idtool.parameters.parameters import Parameters

PARTS = ("gravity", "static", "dynamic", "effects")


@dataclass(frozen=True)
class Row:
    """One parameter: its part or effect, its name, its unit as people write it, and its value."""

    part: str
    name: str
    unit: str
    parameter: Parameter

    @property
    def remark(self) -> str:
        """What a reader must know before using the number; empty if nothing."""
        if self.parameter.at_bound:
            return "at its bound: not found"
        return "" if self.parameter.identified else "not determined by these data"


def rows_of(parameters: Parameters, parts: Sequence[str] = PARTS) -> list[Row]:
    """One row a parameter of the named parts, in the order of the file; "drive" is one more part."""
    kind = parameters.axis.units
    tables = {
        "gravity": (parameters.gravity, GRAVITY_MODELS.get(parameters.gravity_model or "", {})),
        "static": (parameters.static, STATIC),
        "dynamic": (parameters.dynamic, DYNAMIC),
    }
    rows = []
    for part in parts:
        if part in tables:
            values, dimensions = tables[part]
            rows += [Row(part, name, unit_text(dimensions[name], kind), p) for name, p in values.items()]
    if "effects" in parts:
        for entry in parameters.effects:
            of = {p.name: p.dimension for p in registry.get(entry.name).parameters}
            rows += [
                Row(entry.name, name, unit_text(of[name], kind), p) for name, p in entry.parameters.items()
            ]
    drive = parameters.drive
    if "drive" in parts and drive is not None:
        known = {name: getattr(drive, name) for name in drive_dimensions(drive.command)}
        rows += [
            Row("drive", name, unit_text(drive_dimensions(drive.command)[name], kind), one)
            for name, one in known.items()
            if one is not None
        ]
    return rows
