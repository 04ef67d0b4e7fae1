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

from idtool.errors import InputError, nearest
from idtool.io.atomic import atomic_write, refuse_existing
from idtool.io.toml import is_finite, load_toml, short
from idtool.model.units import Units, file_key, is_linear
from idtool.parameters.axis import Axis
from idtool.parameters.drive import LOOP, Drive, check_drive, dimensions
from idtool.parameters.older_files import effects_of_today
from idtool.parameters.physics import ROUNDING, positive, some_friction, within_bounds

if TYPE_CHECKING:
    import pandas as pd

SCHEMA = "ffc-id/params/1"
MAX_BYTES = 1 << 20

GRAVITY_MODELS: dict[str, dict[str, str]] = {
    "slide": {"base": "torque", "per_payload": "torque_per_payload"},
    "arm": {"sin": "torque", "cos": "torque"},
}
STATIC: dict[str, str] = {
    "coulomb": "torque",
    "static": "torque",
    "stribeck_velocity": "velocity",
    "viscous": "damping",
}
DYNAMIC: dict[str, str] = {"bristle_stiffness": "stiffness", "bristle_damping": "damping"}
#: [controller]: key on a rotary and on a linear axis
CONTROLLER_KEYS: dict[str, tuple[str, str]] = {
    "command_gain": ("command_gain_s", "command_gain_s"),
    "loop_gain": ("loop_gain_rad_s_per_nm", "loop_gain_m_s_per_n"),
    "period": ("period_s", "period_s"),
    "start_torque": ("start_torque_nm", "start_force_n"),
}
#: Those that a file may leave out.
_CONTROLLER_OPTIONAL = ("start_torque",)
CONTROLLER_MODES = ("paper", "light")
#: No coefficient of a machine, in SI, comes near (the stiffness of a ball screw is 1e8 N/m).
_MOST = 1e12


@dataclass(frozen=True)
class Parameter:
    """One identified number.

    Attributes:
        value: the estimate, SI.
        stderr: its standard error; None where it was declared, not identified.
        ci95: its 95 % interval; None likewise.
        at_bound: the estimate sits at a bound of its range and is not to be trusted.
        identified: whether the data determine it.
    """

    value: float
    stderr: float | None = None
    ci95: tuple[float, float] | None = None
    at_bound: bool = False
    identified: bool = True

    def to_table(self) -> dict[str, Any]:
        """The inline table of the file.

        A standard error or an interval that is not finite says no more than a missing one; it is left out.
        """
        table: dict[str, Any] = {"value": float(self.value)}
        if self.stderr is not None and math.isfinite(self.stderr):
            table["stderr"] = float(self.stderr)
        if self.ci95 is not None and all(map(math.isfinite, self.ci95)):
            table["ci95"] = [float(bound) for bound in self.ci95]
        return table | {"at_bound": bool(self.at_bound), "identified": bool(self.identified)}


@dataclass(frozen=True)
class EffectEntry:
    """One `[[effects]]` entry: the effect's name and its parameters by base name."""

    name: str
    parameters: dict[str, Parameter]

    def values(self) -> dict[str, float]:
        """Plain numbers by base name."""
        return {name: parameter.value for name, parameter in self.parameters.items()}


@dataclass(frozen=True)
class Controller:
    """The `[controller]` table.

    Attributes:
        command_gain: K_r, s.
        loop_gain: K_c, rad/s per N m (m/s per N).
        period: s.
        start_torque: a hand below this starts no motion, N m (N); None: the mode's own.
        mode: "paper", the published law, or "light" (`idtool.control.admittance`).
    """

    command_gain: float
    loop_gain: float
    period: float
    start_torque: float | None = None
    mode: str = "paper"


@dataclass(frozen=True)
class Parameters:
    """Everything the parameter file holds. A part that was not fitted yet is empty (or None)."""

    axis: Axis = field(default_factory=Axis)
    gravity_model: str | None = None
    gravity: dict[str, Parameter] = field(default_factory=dict)
    static: dict[str, Parameter] = field(default_factory=dict)
    dynamic: dict[str, Parameter] = field(default_factory=dict)
    effects: tuple[EffectEntry, ...] = ()
    controller: Controller | None = None
    provenance: dict[str, Any] = field(default_factory=dict)
    drive: Drive | None = None

    def effect(self, name: str) -> EffectEntry | None:
        """The entry of an effect, or None."""
        return next((entry for entry in self.effects if entry.name == name), None)

    def with_effect(self, entry: EffectEntry) -> Parameters:
        """A copy in which `entry` stands in place of any entry of its name."""
        others = tuple(e for e in self.effects if e.name != entry.name)
        return replace(self, effects=(*others, entry))

    def to_frame(self) -> pd.DataFrame:
        """A table: one row a parameter, with value, stderr, low and high of the 95 % interval, unit, remark.

        Its index is (part, name): part is "gravity", "static", "dynamic" or the name of an effect.
        """
        import pandas as pd

        from idtool.parameters.rows import rows_of

        rows = rows_of(self)
        interval = [row.parameter.ci95 or (math.nan, math.nan) for row in rows]
        return pd.DataFrame(
            {
                "value": [row.parameter.value for row in rows],
                "stderr": [row.parameter.stderr for row in rows],
                "low": [low for low, _ in interval],
                "high": [high for _, high in interval],
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
        if self.static or self.dynamic:
            document["friction"] = {}
            if self.static:
                document["friction"]["static"] = _tables(self.static, STATIC, kind)
            if self.dynamic:
                document["friction"]["dynamic"] = _tables(self.dynamic, DYNAMIC, kind)
        if self.effects:
            document["effects"] = [
                {"name": e.name, "parameters": _tables(e.parameters, _effect_dimensions(e.name), kind)}
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
        Parameters.from_document(document, Path(path))
        text = _text(document, Path(path))
        with atomic_write(path) as stream:
            stream.write(text)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Parameters:
        """Read and check a parameter file.

        Raises:
            InputError: naming the file, the key and what was expected.
        """
        file = Path(path)
        return cls.from_document(load_toml(file, MAX_BYTES), file)

    @classmethod
    def from_document(cls, document: Mapping[str, Any], file: Path) -> Parameters:
        """Check a TOML document; `file` is for messages."""
        if document.get("schema") != SCHEMA:
            raise InputError(
                f"unknown schema {short(document['schema'])}" if "schema" in document else "is missing",
                file=file,
                place="schema",
                remedy=f'expected schema = "{SCHEMA}"',
            )
        known = ("schema", "axis", "gravity", "friction", "effects", "drive", "controller", "provenance")
        _no_strangers(document, known, "", file)
        if "axis" not in document:
            raise InputError(
                "is missing", file=file, place="[axis]", remedy="add [axis] with kind and torque constant"
            )
        axis = Axis.from_table(document["axis"], file=file)
        model, gravity = _read_gravity(document, axis.units, file)
        friction = _table(document.get("friction", {}), "friction", file)
        _no_strangers(friction, ("static", "dynamic"), "friction.", file)
        parts = {
            part: _parameters(friction[part], dimensions, f"friction.{part}", axis.units, file)
            if part in friction
            else {}
            for part, dimensions in (("static", STATIC), ("dynamic", DYNAMIC))
        }
        some_friction(parts["static"], parts["dynamic"], axis.units, file)
        return cls(
            axis=axis,
            gravity_model=model,
            gravity=gravity,
            static=positive(parts["static"], STATIC, "friction.static", axis.units, file),
            dynamic=positive(parts["dynamic"], DYNAMIC, "friction.dynamic", axis.units, file),
            effects=_read_effects(effects_of_today(document, axis.units), axis.units, file),
            drive=_read_drive(document.get("drive"), axis.units, file),
            controller=_read_controller(document.get("controller"), axis.units, file),
            provenance=dict(_table(document.get("provenance", {}), "provenance", file)),
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


def _effect_dimensions(name: str) -> dict[str, str]:
    from idtool.effects import registry  # it loads the compiler, which reading an axis does not need

    return {p.name: p.dimension for p in registry.get(name).parameters}


def _table(value: Any, place: str, file: Path) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise InputError("expected a table", file=file, place=place, remedy=f"write it as [{place}]")
    return value


def _no_strangers(table: Mapping[str, Any], known: tuple[str, ...], prefix: str, file: Path) -> None:
    for key in table:
        if key not in known:
            raise InputError("unknown key", file=file, place=f"{prefix}{key}", remedy=nearest(key, known))


def _read_gravity(
    document: Mapping[str, Any], kind: Units, file: Path
) -> tuple[str | None, dict[str, Parameter]]:
    if "gravity" not in document:
        return None, {}
    table = dict(_table(document["gravity"], "gravity", file))
    model = table.pop("model", None)
    if not isinstance(model, str) or model not in GRAVITY_MODELS:
        raise InputError(
            "is missing" if model is None else f"unknown gravity model {short(model)}",
            file=file,
            place="gravity.model",
            remedy=nearest(short(model).strip("'"), GRAVITY_MODELS),
        )
    return model, _parameters(table, GRAVITY_MODELS[model], "gravity", kind, file)


def _parameters(
    table: Any,
    dimensions: Mapping[str, str],
    place: str,
    kind: Units,
    file: Path,
    optional: frozenset[str] = frozenset(),
) -> dict[str, Parameter]:
    table = _table(table, place, file)
    keys = {file_key(name, dimension, kind): name for name, dimension in dimensions.items()}
    _no_strangers(table, tuple(keys), f"{place}.", file)
    for key, name in keys.items():
        if key not in table and name not in optional:
            raise InputError(
                "is missing", file=file, place=f"{place}.{key}", remedy=f"add {key} = {{value = ...}}"
            )
    return {
        name: _parameter(table[key], f"{place}.{key}", file) for key, name in keys.items() if key in table
    }


def _parameter(value: Any, place: str, file: Path) -> Parameter:
    if not isinstance(value, dict):
        raise InputError(
            f"expected a table, found {short(value)}",
            file=file,
            place=place,
            remedy="write {value = ..., stderr = ...}",
        )
    _no_strangers(value, ("value", "stderr", "ci95", "at_bound", "identified"), f"{place}.", file)
    if "value" not in value:
        raise InputError("is missing", file=file, place=f"{place}.value", remedy="expected a finite number")
    number = _finite(value["value"], f"{place}.value", file)
    if abs(number) > _MOST:
        raise InputError(
            f"expected a number of a machine, below {_MOST:g}, found {number:g}",
            file=file,
            place=f"{place}.value",
            remedy="correct it, or fit it again",
        )
    stderr = _finite(value["stderr"], f"{place}.stderr", file) if "stderr" in value else None
    if stderr is not None and stderr < 0:
        raise InputError("is negative", file=file, place=f"{place}.stderr", remedy="expected a number >= 0")
    interval = None
    if "ci95" in value:
        bounds = value["ci95"]
        if not isinstance(bounds, list) or len(bounds) != 2:
            raise InputError(
                f"expected [low, high], found {short(bounds)}",
                file=file,
                place=f"{place}.ci95",
                remedy="write the two ends of the interval, or remove the key",
            )
        interval = (_finite(bounds[0], f"{place}.ci95", file), _finite(bounds[1], f"{place}.ci95", file))
        if interval[0] > interval[1]:
            raise InputError(
                "low is above high", file=file, place=f"{place}.ci95", remedy="expected [low, high]"
            )
        slack = ROUNDING * (1.0 + abs(number))
        if not interval[0] - slack <= number <= interval[1] + slack:
            raise InputError(
                f"[{interval[0]:g}, {interval[1]:g}] does not hold the value {number:g}",
                file=file,
                place=f"{place}.ci95",
                remedy="expected the interval of this value; correct it, or remove the key",
            )
    flags = {}
    for flag, default in (("at_bound", False), ("identified", True)):
        flags[flag] = value.get(flag, default)
        if not isinstance(flags[flag], bool):
            raise InputError(
                f"expected true or false, found {short(flags[flag])}",
                file=file,
                place=f"{place}.{flag}",
                remedy="write true or false without quotes",
            )
    return Parameter(number, stderr, interval, **flags)


def _finite(value: Any, place: str, file: Path) -> float:
    if not is_finite(value):
        raise InputError(
            f"expected a finite number, found {short(value)}",
            file=file,
            place=place,
            remedy="write a number there",
        )
    return float(value)


def _read_effects(entries: Any, kind: Units, file: Path) -> tuple[EffectEntry, ...]:
    from idtool.effects import registry

    if not isinstance(entries, list):
        raise InputError(
            "expected a list of tables", file=file, place="effects", remedy="write it as [[effects]]"
        )
    result: list[EffectEntry] = []
    for index, entry in enumerate(entries):
        place = f"effects[{index}]"
        table = _table(entry, place, file)
        _no_strangers(table, ("name", "parameters"), f"{place}.", file)
        name = table.get("name")
        if not isinstance(name, str) or not registry.knows(name):
            raise InputError(
                "is missing" if name is None else f"unknown effect {short(name)}",
                file=file,
                place=f"{place}.name",
                remedy=nearest(short(name).strip("'"), registry.names()),
            )
        if any(other.name == name for other in result):
            raise InputError(
                f"effect {name} appears twice", file=file, place=f"{place}.name", remedy="remove one"
            )
        optional = frozenset(p.name for p in registry.get(name).parameters if p.optional)
        values = _parameters(
            table.get("parameters", {}), _effect_dimensions(name), f"{place}.parameters", kind, file, optional
        )
        within_bounds(name, values, f"{place}.parameters", kind, file)
        result.append(EffectEntry(name, values))
    return tuple(result)


def _read_drive(table: Any, kind: Units, file: Path) -> Drive | None:
    if table is None:
        return None
    table = dict(_table(table, "drive", file))
    command, setting = check_drive(table, file)
    numbers = {key: value for key, value in table.items() if key not in ("command", "gain_setting")}
    known = dimensions(command)
    loop = any(file_key(name, known[name], kind) in numbers for name in LOOP)
    optional = frozenset(known) - (frozenset(LOOP) if loop else frozenset())
    read = _parameters(numbers, known, "drive", kind, file, optional)
    for name in {"bend", "dead_band"} & set(read):
        if read[name].value < 0.0:
            raise InputError(
                f"expected a number >= 0, found {read[name].value:g}",
                file=file,
                place=f"drive.{name}.value",
                remedy="correct it, or fit it again",
            )
    return Drive(command, **read, gain_setting=setting)


def _read_controller(table: Any, kind: Units, file: Path) -> Controller | None:
    if table is None:
        return None
    table = _table(table, "controller", file)
    keys = {options[is_linear(kind)]: name for name, options in CONTROLLER_KEYS.items()}
    _no_strangers(table, (*keys, "mode"), "controller.", file)
    mode = table.get("mode", "paper")
    if mode not in CONTROLLER_MODES:
        raise InputError(
            f"unknown mode {short(mode)}",
            file=file,
            place="controller.mode",
            remedy=nearest(short(mode).strip("'"), CONTROLLER_MODES),
        )
    values = {}
    for key, name in keys.items():
        if key not in table and name in _CONTROLLER_OPTIONAL:
            continue
        if key not in table:
            raise InputError(
                "is missing", file=file, place=f"controller.{key}", remedy="expected a number > 0"
            )
        values[name] = _finite(table[key], f"controller.{key}", file)
        if values[name] <= 0:
            raise InputError(
                f"expected a number > 0, found {values[name]:g}",
                file=file,
                place=f"controller.{key}",
                remedy="correct it",
            )
    return Controller(**values, mode=mode)
