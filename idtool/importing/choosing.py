"""Which column of a recording is what of a log, and in which unit: as options say, else as names tell."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError, UsageError
from idtool.importing import cleaning
from idtool.importing.conversion import (
    TURNED_ROUND,
    Unit,
    dimension,
    given_unit,
    is_unit,
    named_unit,
    si_unit,
)
from idtool.importing.names import (
    Meaning,
    Taken,
    as_command,
    choose,
    meaning,
    meaning_by_unit,
    role_of,
    unit_at_end,
)
from idtool.importing.table import Table
from idtool.log.format import columns_of
from idtool.model.units import Kind, torque_name

#: What can stand for the motor's torque.
_EFFORTS = ("torque", "current", "bus_current", "duty")


def by_unit(source: Table, names: list[str]) -> list[Meaning]:
    """Columns whose names say nothing and whose units do."""
    nameless = [name for name in names if meaning_of(source, name) is None]
    return [m for name in nameless if (m := meaning_by_unit(name, source.units.get(name, "")))]


def meaning_of(source: Table, name: str) -> Meaning | None:
    """What a column means: as its format says, else as its name and the unit beside it do."""
    found = source.meanings.get(name) or meaning(name)
    if found is None or found.unit:
        return found
    return replace(found, unit=_stated_unit(source, name, found.role))


def _stated_unit(source: Table, name: str, role: str) -> str:
    """The unit that the recording states beside a column's name, "" if none of the role's."""
    unit = source.units.get(name, "")
    return unit if is_unit(unit, role) else ""


def given(
    table_source: Table, table: pd.DataFrame, mapping: Mapping[str, str], stated: dict[str, Kind]
) -> tuple[dict[str, Meaning], set[str]]:
    """Role -> column as `mapping` says, and the columns that are thereby spoken for."""
    chosen: dict[str, Meaning] = {}
    for left, source in mapping.items():
        role, implied = role_of(left)
        cleaning.source_column(table, source, f"--map {left}={source}")
        if role in chosen:
            raise UsageError(f"--map names the {role} twice; name it once.")
        if implied:
            stated[f"--map {left}"] = implied
        told = meaning_of(table_source, source)
        same = told is not None and told.role == role.removesuffix("_command")
        ends = unit_at_end(source, role) or _stated_unit(table_source, source, role)
        unit = told.unit if told and same else ends
        chosen[role] = Meaning(source, role, unit, bool(told and told.commanded))
    return chosen, {item.source for item in chosen.values()}


def fill(chosen: dict[str, Meaning], free: list[Meaning], by_unit: list[Meaning], kind: Kind) -> None:
    """Choose columns for the roles that no option names: by their names, else by a unit that one column has;
    a command stands in where nothing was measured."""
    measured = [m for m in free if not m.commanded]
    commands = [as_command(m) for m in free if m.commanded]
    for role in columns_of(kind):
        if role in chosen or (role in ("current", "torque") and _one_effort_is_given(chosen)):
            continue
        found = choose(commands if role.endswith("_command") else measured, role, kind)
        if found:
            chosen[role] = found
    alone = [m for m in by_unit if named_unit(m.unit, m.role, kind)]
    for roles in (("time",), ("position",), ("velocity",), _EFFORTS):  # a force beside a current may be any
        fitting = [m for m in alone if m.role in roles]
        if len(fitting) == 1 and not set(roles) & set(chosen):
            chosen[fitting[0].role] = fitting[0]
    for role in ("torque", "current"):
        if not set(_EFFORTS) & set(chosen) and (found := choose(commands, role, kind)):
            chosen[role] = found


def _one_effort_is_given(chosen: Mapping[str, Meaning]) -> bool:
    return any(role in chosen and chosen[role].commanded for role in ("current", "torque"))


def drop_empty(chosen: dict[str, Meaning], table: pd.DataFrame, notes: list[str]) -> None:
    for role, item in list(chosen.items()):
        if table[item.source].isna().all():
            notes.append(f'column "{item.source}" is empty; not taken for {role}')
            del chosen[role]


def require(chosen: Mapping[str, Meaning], table: pd.DataFrame, kind: Kind) -> None:
    names = columns_of(kind)
    filled = [str(name) for name in table.columns if table[name].notna().any()]
    there = ", ".join(filled[:12])
    effort_by_voltage = {"duty", "bus_current"} & set(chosen)
    needed = [("time",), ("position", "velocity"), *([] if effort_by_voltage else [("torque", "current")])]
    missing = [roles for roles in needed if not any(role in chosen for role in roles)]
    if not missing:
        return
    words = [
        " or ".join(torque_name(kind) if role == "torque" else role for role in roles) for roles in missing
    ]
    choices = [" or ".join(f"{names[role]}=COLUMN" for role in roles) for roles in missing]
    # a counter is never guessed: nobody but its owner knows how many counts a turn has
    counter = ("position", "velocity") in missing and re.search("count|tick", there, re.IGNORECASE)
    ask = "say which is it" if len(missing) == 1 else "say which they are"
    raise InputError(
        f"no column looks like {', nor like '.join(words)} (it has {there})",
        remedy=f"{ask} with --map {', --map '.join(choices)}"
        + (", or the motor's voltage with --map duty=COLUMN" if ("torque", "current") in missing else "")
        + (", and of a counter --unit position=count:COUNTS_PER_TURN" if counter else ""),
    )


def with_units(
    chosen: Mapping[str, Meaning],
    given: set[str],
    units: Mapping[str, str],
    presumed: Mapping[str, str],
    kind: Kind,
    table: pd.DataFrame,
) -> tuple[Taken, ...]:
    stated: dict[str, str] = {}
    for left, text in units.items():
        role, _ = role_of(left)
        if text != TURNED_ROUND:
            given_unit(text, role, kind)  # a misspelt unit is told before a missing column
        if role not in chosen:
            raise UsageError(
                f"--unit {left}={text}: no column was taken for {role}; add --map {left}=COLUMN."
            )
        stated[role] = text
    taken = []
    for role, column in columns_of(kind).items():
        if role not in chosen:
            continue
        item = chosen[role]
        named = named_unit(item.unit, role, kind) if item.unit else None
        why = "given" if item.source in given else "unit" if item.by_unit else "named"
        unit = named or Unit(si_unit(role, kind), 1.0)
        text = stated.get(role, "")
        if text and text != TURNED_ROUND:
            unit, why = given_unit(text, role, kind), "given"
        elif not named and item.source in presumed and kind == "rotary":
            unit, why = given_unit(presumed[item.source], role, kind), "presumed"
        elif not named and dimension(role, kind) and item.source not in given:
            why = "presumed"
            if role == "time":
                _refuse_odd_clock(table[item.source], item.source)
        if text == TURNED_ROUND:
            unit = given_unit(f"-{unit.text or 1}", role, kind)
        commanded = item.commanded and role in ("torque", "current")
        taken.append(Taken(column, role, item.source, unit, why, commanded))
    return tuple(taken)


def _refuse_odd_clock(column: pd.Series[Any], name: str) -> None:
    """A clock of unknown unit that steps by a second or more is likely one of milli- or microseconds."""
    if not pd.api.types.is_numeric_dtype(column):
        return
    times = column.to_numpy(dtype=float, na_value=np.nan)
    steps = np.diff(times[np.isfinite(times)])
    rising = steps[steps > 0]  # not where another trial begins, nor where a value is missing
    step = float(np.median(rising)) if len(rising) > 1 else 0.0
    if step >= 1:
        raise InputError(
            f'column "{name}" has no unit and steps by {step:g}, which is slow for seconds',
            remedy="say its unit with --unit time=ms (or us, ns, s)",
        )
