"""The one parameter file: TOML, `schema = "ffc-id/params/1"`.

    parameters = Parameters.read("params.toml")
    parameters.static["coulomb"].value        # N m
    parameters.write("copy.toml")

In memory the keys are base names ("coulomb", "bristle_stiffness"); in the file the unit ends them.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from idtool.errors import InputError, in_file
from idtool.io.atomic import atomic_write, refuse_existing
from idtool.io.lock import held_folder
from idtool.io.tables import check_schema, no_strangers, table_at
from idtool.io.toml import is_finite, load_toml, short
from idtool.model.units import Units, file_key, is_linear
from idtool.parameters.axis import Axis
from idtool.parameters.contents import (
    CONTROLLER_KEYS,
    DYNAMIC,
    GRAVITY_MODELS,
    NO_GRAVITY,
    STATIC,
    Controller,
    EffectEntry,
)
from idtool.parameters.drive import Drive
from idtool.parameters.older_files import effects_of_today
from idtool.parameters.parameter import Parameter, read_parameters
from idtool.parameters.physics import positive, some_friction
from idtool.parameters.reading import (
    effect_dimensions,
    read_controller,
    read_drive,
    read_effects,
    read_gravity,
)

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = "ffc-id/params/1"


@dataclass(frozen=True, repr=False)
class Parameters:
    """Everything the parameter file holds. A part that was not fitted yet is empty (or None).

    Where gravity is known not to act (`model = "none"` in the file) the axis is `weightless`.
    """

    axis: Axis = field(default_factory=Axis)
    gravity_model: str | None = None
    gravity: dict[str, Parameter] = field(default_factory=dict)
    static: dict[str, Parameter] = field(default_factory=dict)
    dynamic: dict[str, Parameter] = field(default_factory=dict)
    effects: tuple[EffectEntry, ...] = ()
    controller: Controller | None = None
    provenance: dict[str, Any] = field(default_factory=dict)
    drive: Drive | None = None
    weightless: bool = False

    def __repr__(self) -> str:
        table = self.to_frame()
        numbers = (
            table.to_string(na_rep="", float_format="{:.5g}".format)
            if len(table)
            else "nothing is fitted yet"
        )
        return f"<Parameters of a {self.axis.kind} axis>\n{numbers}"

    @property
    def has_bristle(self) -> bool:
        """Whether the friction has a bristle that the data saw.

        A stiffness at its bound stands for "stiffer than the position shows": the static curve then.
        """
        return bool(self.dynamic) and not self.dynamic["bristle_stiffness"].at_bound

    @property
    def rig(self) -> str:
        """The word that opens the rig of the logs behind it (`--rig`); "" where they did not say."""
        spec = self.provenance.get("rig")
        return spec if isinstance(spec, str) else ""

    @property
    def logs(self) -> list[str]:
        """Files of the logs behind it, as they were named then."""
        named = self.provenance.get("logs")
        listed = named if isinstance(named, list) else []
        return [log for log in listed if isinstance(log, str) and "\0" not in log]

    @property
    def unexplained(self) -> str | None:
        """A sentence, without a full stop, where the session behind the file ended so; None else."""
        known = self.provenance
        if known.get("verdict") != "unexplained":
            return None
        left, names = known.get("left_percent_of_torque"), known.get("depends_on")
        size = f"{left:.3g} % of the torque" if is_finite(left) else "more than noise"
        words = [short(name).strip("'") for name in names] if isinstance(names, list) else []
        on = f", which depends on {' and '.join(words)}" if words else ""
        return f"the session of the parameter file ended as unexplained: it left {size}{on}; expect no less"

    def effect(self, name: str) -> EffectEntry | None:
        """The entry of an effect, or None."""
        return next((entry for entry in self.effects if entry.name == name), None)

    def with_effect(self, entry: EffectEntry) -> Parameters:
        """A copy in which `entry` stands in place of any entry of its name."""
        others = tuple(e for e in self.effects if e.name != entry.name)
        return replace(self, effects=(*others, entry))

    def to_frame(self) -> pd.DataFrame:
        """A table: one row a parameter, with value, stderr, low and high of the 95 % interval, unit, remark.

        Of a parameter that is not determined, low or high is what bound there is.

        Its index is (part, name): part is "gravity", "static", "dynamic" or the name of an effect.
        """
        import pandas as pd

        from idtool.parameters.rows import rows_of

        rows = rows_of(self)
        known = [(row.parameter.at_least, row.parameter.at_most) for row in rows]
        interval = [row.parameter.ci95 or limits for row, limits in zip(rows, known, strict=True)]
        return pd.DataFrame(
            {
                "value": [row.parameter.value for row in rows],
                "stderr": [row.parameter.stderr for row in rows],
                "low": [math.nan if low is None else low for low, _ in interval],
                "high": [math.nan if high is None else high for _, high in interval],
                "unit": [row.unit for row in rows],
                "remark": [row.remark for row in rows],
            },
            index=pd.MultiIndex.from_tuples([(row.part, row.name) for row in rows], names=["part", "name"]),
        )

    def to_document(self) -> dict[str, Any]:
        """The TOML document."""
        kind = self.axis.units
        document: dict[str, Any] = {"schema": SCHEMA, "axis": self.axis.to_table()}
        if self.gravity_model:
            dimensions = GRAVITY_MODELS[self.gravity_model]
            document["gravity"] = {"model": self.gravity_model, **_tables(self.gravity, dimensions, kind)}
        elif self.weightless:
            document["gravity"] = {"model": NO_GRAVITY}
        if self.static or self.dynamic:
            document["friction"] = {}
            if self.static:
                document["friction"]["static"] = _tables(self.static, STATIC, kind)
            if self.dynamic:
                document["friction"]["dynamic"] = _tables(self.dynamic, DYNAMIC, kind)
        if self.effects:
            document["effects"] = [
                {"name": e.name, "parameters": _tables(e.parameters, effect_dimensions(e.name), kind)}
                for e in self.effects
            ]
        if self.drive:
            document["drive"] = self.drive.to_table(kind)
        if self.controller:
            mode = {"mode": self.controller.mode} if self.controller.mode != "paper" else {}
            document["controller"] = mode | {
                keys[is_linear(kind)]: float(value)
                for name, keys in CONTROLLER_KEYS.items()
                if (value := getattr(self.controller, name)) is not None
            }
        if self.provenance:
            document["provenance"] = self.provenance
        return document

    def write(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the file whole or not at all; a parameter file that is there keeps its comments.

        Raises:
            InputError: `path` exists and `force` is not given, it cannot be written, or `read` would not
                take what is in it.
        """
        refuse_existing(Path(path), force)
        document = self.to_document()
        with in_file(path):
            Parameters.from_document(document)
        text = _text(document, Path(path))
        with atomic_write(path) as stream:
            stream.write(text)

    def write_over(self, path: str | os.PathLike[str], known: Parameters | None) -> None:
        """Write where `known` was read, or where there was no file (None).

        Raises:
            InputError: what is there now is not that: a second program, or a person, wrote it meanwhile.
        """
        file = Path(path)
        with held_folder(file.parent):  # nobody writes between the look and the writing
            if file.exists() and Parameters.read(file) != known:
                raise InputError("was written by somebody else meanwhile", file=file, remedy="run this again")
            self.write(file, force=True)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Parameters:
        """Read and check a parameter file.

        Raises:
            InputError: naming the file, the key and what was expected.
        """
        file = Path(path)
        with in_file(file):
            return cls.from_document(load_toml(file))

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Parameters:
        """Check a TOML document."""
        check_schema(document, SCHEMA)
        known = ("schema", "axis", "gravity", "friction", "effects", "drive", "controller", "provenance")
        no_strangers(document, known, "")
        if "axis" not in document:
            raise InputError("is missing", place="[axis]", remedy="add [axis] with kind and torque constant")
        axis = Axis.from_table(document["axis"])
        model, gravity = read_gravity(document, axis.units)
        friction = table_at(document.get("friction", {}), "friction")
        no_strangers(friction, ("static", "dynamic"), "friction.")
        parts = {
            part: read_parameters(friction[part], dimensions, f"friction.{part}", axis.units)
            if part in friction
            else {}
            for part, dimensions in (("static", STATIC), ("dynamic", DYNAMIC))
        }
        some_friction(parts["static"], parts["dynamic"], axis.units)
        return cls(
            axis=axis,
            gravity_model=None if model == NO_GRAVITY else model,
            gravity=gravity,
            weightless=model == NO_GRAVITY,
            static=positive(parts["static"], STATIC, "friction.static", axis.units),
            dynamic=positive(parts["dynamic"], DYNAMIC, "friction.dynamic", axis.units),
            effects=read_effects(effects_of_today(document, axis.units), axis.units),
            drive=read_drive(document.get("drive"), axis.units),
            controller=read_controller(document.get("controller"), axis.units),
            provenance=dict(table_at(document.get("provenance", {}), "provenance")),
        )


def _text(document: Mapping[str, Any], file: Path) -> str:
    """The document as TOML; where `file` is a parameter file already, with its comments and layout."""
    from idtool.io.revise_toml import revised  # only writing needs tomlkit

    try:
        Parameters.read(file)
        return revised(file.read_text("utf-8-sig"), document)
    except (InputError, OSError, ValueError):  # none there, or none that can be kept
        return revised("", document)


def _tables(values: Mapping[str, Parameter], dimensions: Mapping[str, str], kind: Units) -> dict[str, Any]:
    return {
        file_key(name, dimensions[name], kind): values[name].to_table()
        for name in dimensions
        if name in values
    }
