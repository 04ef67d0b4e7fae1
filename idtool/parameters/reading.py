"""The tables of a parameter file, read and checked one by one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from idtool.errors import InputError, nearest
from idtool.io.tables import finite, no_strangers, table_at
from idtool.io.toml import short
from idtool.model.units import Units, file_key, is_linear
from idtool.parameters.contents import (
    CONTROLLER_KEYS,
    CONTROLLER_MODES,
    CONTROLLER_OPTIONAL,
    GRAVITY_MODELS,
    NO_GRAVITY,
    PERIODS_S,
    Controller,
    EffectEntry,
)
from idtool.parameters.drive import LOOP, Drive, check_drive, dimensions
from idtool.parameters.parameter import MOST, Parameter, read_parameters
from idtool.parameters.physics import within_bounds


def effect_dimensions(name: str) -> dict[str, str]:
    from idtool.effects import registry  # it loads the compiler, which reading an axis does not need

    return {p.name: p.dimension for p in registry.get(name).parameters}


def read_gravity(document: Mapping[str, Any], kind: Units) -> tuple[str | None, dict[str, Parameter]]:
    if "gravity" not in document:
        return None, {}
    table = dict(table_at(document["gravity"], "gravity"))
    model = table.pop("model", None)
    known = {**GRAVITY_MODELS, NO_GRAVITY: {}}
    if not isinstance(model, str) or model not in known:
        raise InputError(
            "is missing" if model is None else f"unknown gravity model {short(model)}",
            place="gravity.model",
            remedy=nearest(short(model).strip("'"), known),
        )
    return model, read_parameters(table, known[model], "gravity", kind)


def read_effects(entries: Any, kind: Units) -> tuple[EffectEntry, ...]:
    from idtool.effects import registry

    if not isinstance(entries, list):
        raise InputError("expected a list of tables", place="effects", remedy="write it as [[effects]]")
    result: list[EffectEntry] = []
    for index, entry in enumerate(entries):
        place = f"effects[{index}]"
        table = table_at(entry, place)
        no_strangers(table, ("name", "parameters"), f"{place}.")
        name = table.get("name")
        if not isinstance(name, str) or not registry.knows(name):
            raise InputError(
                "is missing" if name is None else f"unknown effect {short(name)}",
                place=f"{place}.name",
                remedy=nearest(short(name).strip("'"), registry.names()),
            )
        if any(other.name == name for other in result):
            raise InputError(f"effect {name} appears twice", place=f"{place}.name", remedy="remove one")
        optional = frozenset(p.name for p in registry.get(name).parameters if p.optional)
        values = read_parameters(
            table.get("parameters", {}), effect_dimensions(name), f"{place}.parameters", kind, optional
        )
        within_bounds(name, values, f"{place}.parameters", kind)
        result.append(EffectEntry(name, values))
    return tuple(result)


def read_drive(table: Any, kind: Units) -> Drive | None:
    if table is None:
        return None
    table = dict(table_at(table, "drive"))
    command, setting = check_drive(table)
    numbers = {key: value for key, value in table.items() if key not in ("command", "gain_setting")}
    known = dimensions(command)
    loop = any(file_key(name, known[name], kind) in numbers for name in LOOP)
    optional = frozenset(known) - (frozenset(LOOP) if loop else frozenset())
    read = read_parameters(numbers, known, "drive", kind, optional)
    for name in {"bend", "dead_band"} & set(read):
        if read[name].value < 0.0:
            raise InputError(
                f"expected a number >= 0, found {read[name].value:g}",
                place=f"drive.{name}.value",
                remedy="correct it, or fit it again",
            )
    return Drive(command, **read, gain_setting=setting)


def read_controller(table: Any, kind: Units) -> Controller | None:
    if table is None:
        return None
    table = table_at(table, "controller")
    keys = {options[is_linear(kind)]: name for name, options in CONTROLLER_KEYS.items()}
    no_strangers(table, (*keys, "mode"), "controller.")
    mode = table.get("mode", "paper")
    if mode not in CONTROLLER_MODES:
        raise InputError(
            f"unknown mode {short(mode)}",
            place="controller.mode",
            remedy=nearest(short(mode).strip("'"), CONTROLLER_MODES),
        )
    values = {}
    for key, name in keys.items():
        if key not in table and name in CONTROLLER_OPTIONAL:
            continue
        if key not in table:
            raise InputError("is missing", place=f"controller.{key}", remedy="expected a number > 0")
        values[name] = finite(table[key], f"controller.{key}")
        least, most = PERIODS_S if name == "period" else (0.0, MOST)
        if not least <= values[name] <= most or values[name] == 0.0:
            wanted = (
                f"from {least:g} to {most:g}" if least else "> 0" if values[name] <= 0 else f"below {MOST:g}"
            )
            raise InputError(
                f"expected a number {wanted}, found {values[name]:g}",
                place=f"controller.{key}",
                remedy="correct it",
            )
    return Controller(**values, mode=mode)
