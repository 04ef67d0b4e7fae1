"""From a recording to a log: choose columns, convert, clean, and keep account of all of it."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError, UsageError
from idtool.importing import cleaning
from idtool.importing.conversion import Unit, dimension, given_unit, named_unit, si_unit
from idtool.importing.names import (
    Meaning,
    Taken,
    as_command,
    check_kind,
    choose,
    choose_kind,
    meaning,
    role_of,
    unit_at_end,
)
from idtool.importing.sources import read_table
from idtool.importing.table import Table
from idtool.log import Log
from idtool.log.format import columns_of
from idtool.model.units import Kind, torque_name
from idtool.parameters.axis import Axis, check_constant

#: Roles that change slowly or stay until set anew, so that a gap holds the last value.
_HELD = (
    "payload",
    "tilt_alpha",
    "tilt_beta",
    "temperature",
    "supply_voltage",
    "position_command",
    "velocity_command",
    "drive_on",
)
_CORE = ("time", "position", "velocity", "current", "torque", "bus_current", "duty")
#: What can stand for the motor's torque.
_EFFORTS = ("torque", "current", "bus_current", "duty")


@dataclass(frozen=True)
class Imported:
    """A recording made into a log.

    Attributes:
        log: the log, checked, not written.
        taken: which column was taken for what.
        kept: other columns, kept as they are.
        notes: what was repaired or presumed, one sentence each.
        rows_read: rows of the recording (after `where`).
    """

    log: Log
    taken: tuple[Taken, ...]
    kept: tuple[str, ...]
    notes: tuple[str, ...]
    rows_read: int


def import_recording(
    path: str | os.PathLike[str],
    *,
    mapping: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    trial_by: str | None = None,
    where: Mapping[str, Sequence[str]] | None = None,
    torque_constant: float | None = None,
    experiment: str = "",
    kind: Kind | None = None,
    unwrap: float | None = None,
) -> Imported:
    """Read a recording and make it a log.

    Args:
        path: a file of any format in docs/import.md, or the folder of a ROS 2 bag.
        mapping: column of a log, or role ("position") -> column of the recording; the rest is guessed.
        units: role -> unit of its column ("deg", "count:4096", "0.229rpm"); else the name tells.
        trial_by: column whose values part the trials.
        where: column -> values; only rows that hold one of them are taken.
        torque_constant: K in N m/A (N/A on a linear axis).
        experiment: what the log shall say it is.
        kind: of axis; else as units tell.
        unwrap: the period of a position that wraps, in the unit of its column.

    Raises:
        InputError: the file cannot be used, or a column is missing or ambiguous.
        UsageError: options that make no sense.
    """
    file = Path(path)
    source = read_table(file)
    header, notes = source.header, source.notes
    table = cleaning.keep_where(source.frame, where or {}, file)
    cleaning.require_single(table, source.single, file)
    stated: dict[str, Kind] = {f"--kind {kind}": kind} if kind else {}
    chosen, given = _given(source, table, mapping or {}, stated, file)
    old_axis = Axis.from_table(header["axis"], file=file) if "axis" in header else None
    if old_axis and not stated:
        stated["its [axis] table"] = old_axis.kind
    free = [m for name in table.columns if name not in given and (m := _meaning(source, str(name)))]
    axis_kind = choose_kind([*free, *chosen.values()], stated, file)
    check_kind(chosen.values(), axis_kind, file)
    _fill(chosen, free, axis_kind, file)
    if trial_by:
        cleaning.source_column(table, trial_by, "--trial-by", file)
        chosen["trial"] = Meaning(trial_by, "trial")
    _drop_empty(chosen, table, notes)
    _require(chosen, table, axis_kind, file)
    # a role ("current") says no unit, a column of a log ("current_a") does
    given -= {column for left, column in (mapping or {}).items() if left == role_of(left)[0]}
    taken = _units(chosen, given, units or {}, source.presumed, axis_kind, table, file)
    frame, kept = _convert(table, taken, axis_kind, unwrap, file, notes)
    axis = _axis(axis_kind, torque_constant, old_axis)
    rows = len(frame)
    frame = _clean(frame, taken, file, notes)
    _remark(frame, taken, axis_kind, unwrap, notes)
    _remark_effort(taken, axis, notes)
    experiment = experiment or source.experiment or str(header.get("experiment", ""))
    provenance = _provenance(file, taken, where, trial_by, unwrap) | source.facts
    log = Log(frame, axis, experiment, provenance, str(file))
    return Imported(log, taken, tuple(kept), tuple(notes), rows)


def _meaning(source: Table, name: str) -> Meaning | None:
    """What a column means: as its format says, else as its name and the unit beside it do."""
    found = source.meanings.get(name) or meaning(name)
    if found is None or found.unit:
        return found
    return replace(found, unit=_stated_unit(source, name, found.role))


def _stated_unit(source: Table, name: str, role: str) -> str:
    """The unit that the recording states beside a column's name, "" if none of the role's."""
    unit = source.units.get(name, "")
    return unit if any(named_unit(unit, role, kind) for kind in ("rotary", "linear")) else ""


def _given(
    table_source: Table, table: pd.DataFrame, mapping: Mapping[str, str], stated: dict[str, Kind], file: Path
) -> tuple[dict[str, Meaning], set[str]]:
    """Role -> column as `mapping` says, and the columns that are thereby spoken for."""
    chosen: dict[str, Meaning] = {}
    for left, source in mapping.items():
        role, implied = role_of(left)
        cleaning.source_column(table, source, f"--map {left}={source}", file)
        if role in chosen:
            raise UsageError(f"--map names the {role} twice; name it once.")
        if implied:
            stated[f"--map {left}"] = implied
        told = _meaning(table_source, source)
        same = told is not None and told.role == role.removesuffix("_command")
        ends = unit_at_end(source, role) or _stated_unit(table_source, source, role)
        unit = told.unit if told and same else ends
        chosen[role] = Meaning(source, role, unit, bool(told and told.commanded))
    return chosen, {item.source for item in chosen.values()}


def _fill(chosen: dict[str, Meaning], free: list[Meaning], kind: Kind, file: Path) -> None:
    """Choose columns for the roles that no option names; a command stands in where nothing was measured."""
    measured = [m for m in free if not m.commanded]
    commands = [as_command(m) for m in free if m.commanded]
    for role in columns_of(kind):
        if role in chosen or (role in ("current", "torque") and _one_effort_is_given(chosen)):
            continue
        found = choose(commands if role.endswith("_command") else measured, role, kind, file)
        if found:
            chosen[role] = found
    for role in ("torque", "current"):
        if not set(_EFFORTS) & set(chosen) and (found := choose(commands, role, kind, file)):
            chosen[role] = found


def _one_effort_is_given(chosen: Mapping[str, Meaning]) -> bool:
    return any(role in chosen and chosen[role].commanded for role in ("current", "torque"))


def _drop_empty(chosen: dict[str, Meaning], table: pd.DataFrame, notes: list[str]) -> None:
    for role, item in list(chosen.items()):
        if table[item.source].isna().all():
            notes.append(f'column "{item.source}" is empty; not taken for {role}')
            del chosen[role]


def _require(chosen: Mapping[str, Meaning], table: pd.DataFrame, kind: Kind, file: Path) -> None:
    names = columns_of(kind)
    filled = [str(name) for name in table.columns if table[name].notna().any()]
    there = ", ".join(filled[:12])
    for roles in (("time",), ("position", "velocity"), ("torque", "current")):
        if roles[0] == "torque" and {"duty", "bus_current"} & set(chosen):
            continue
        if not any(role in chosen for role in roles):
            words = " or ".join(torque_name(kind) if role == "torque" else role for role in roles)
            choices = " or ".join(f"{names[role]}=COLUMN" for role in roles)
            # a counter is never guessed: nobody but its owner knows how many counts a turn has
            counter = roles[0] == "position" and re.search("count|tick", there, re.IGNORECASE)
            raise InputError(
                f"no column looks like {words} (it has {there})",
                file=file,
                remedy=f"say which is it with --map {choices}"
                + (", and of a counter --unit position=count:COUNTS_PER_TURN" if counter else ""),
            )


def _units(
    chosen: Mapping[str, Meaning],
    given: set[str],
    units: Mapping[str, str],
    presumed: Mapping[str, str],
    kind: Kind,
    table: pd.DataFrame,
    file: Path,
) -> tuple[Taken, ...]:
    stated: dict[str, str] = {}
    for left, text in units.items():
        role, _ = role_of(left)
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
        why = "given" if item.source in given else "named"
        unit = named or Unit(si_unit(role, kind), 1.0)
        if role in stated:
            unit, why = given_unit(stated[role], role, kind), "given"
        elif not named and item.source in presumed and kind == "rotary":
            unit, why = given_unit(presumed[item.source], role, kind), "presumed"
        elif not named and dimension(role, kind) and item.source not in given:
            why = "presumed"
            if role == "time":
                _refuse_odd_clock(table[item.source], item.source, file)
        taken.append(
            Taken(column, role, item.source, unit, why, item.commanded and role in ("torque", "current"))
        )
    return tuple(taken)


def _refuse_odd_clock(column: pd.Series[Any], name: str, file: Path) -> None:
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
            file=file,
            remedy="say its unit with --unit time=ms (or us, ns, s)",
        )


def _convert(
    table: pd.DataFrame,
    taken: tuple[Taken, ...],
    kind: Kind,
    unwrap: float | None,
    file: Path,
    notes: list[str],
) -> tuple[pd.DataFrame, list[str]]:
    """The log's columns in SI, in the log's order, then the other columns as they are."""
    if unwrap is not None and not any(item.role == "position" for item in taken):
        raise UsageError("--unwrap needs a position column; name it with --map.")
    columns: dict[str, Any] = {"trial": np.zeros(len(table), dtype=np.int64)}
    labels: list[str] = []
    for item in taken:
        source = table[item.source]
        if item.role == "trial":
            columns["trial"], numbered = cleaning.trial_numbers(source)
            if numbered:
                labels.append(item.source)
            continue
        seconds = cleaning.date_seconds(source) if item.role == "time" else None
        if seconds is not None:
            columns[item.column] = seconds
            continue
        values = cleaning.to_numbers(source, item.source, file)
        columns[item.column] = values * item.unit.factor + item.unit.offset
        bad = int(np.isnan(values).sum()) - int(source.isna().sum())
        if bad > 0:
            notes.append(f'column "{item.source}": {bad} cells are text or infinite, taken as missing')
    used = {item.source for item in taken} - set(labels)
    reserved = set(columns_of(kind).values())
    kept = [str(name) for name in table.columns if name not in used]
    for name in kept:
        columns[f"source_{name}" if name in reserved else name] = table[name].to_numpy()
    frame = pd.DataFrame(columns)
    if unwrap is not None:
        _unwrap(frame, columns_of(kind)["position"], unwrap, taken, notes)
    return frame, kept


def _unwrap(
    frame: pd.DataFrame, name: str, period: float, taken: tuple[Taken, ...], notes: list[str]
) -> None:
    unit = next(item.unit for item in taken if item.role == "position")
    period_si = abs(period * unit.factor)
    before = frame[name].to_numpy(copy=True)
    good = np.isfinite(before)
    jumps = 0
    for rows in frame[good].groupby("trial", sort=False).indices.values():
        index = np.flatnonzero(good)[rows]
        frame.loc[index, name] = np.unwrap(before[index], period=period_si)
        jumps += int((np.abs(np.diff(before[index])) > period_si / 2).sum())
    notes.append(f"unwrapped {jumps} jumps of the position with period {period:g} {unit.text}")


def _clean(frame: pd.DataFrame, taken: tuple[Taken, ...], file: Path, notes: list[str]) -> pd.DataFrame:
    core = [item.column for item in taken if item.role in _CORE]
    missing = frame[core].isna().any(axis=1).to_numpy()
    if missing.any():
        where = ", ".join(name for name in core if frame[name].isna().any())
        if missing.all():
            raise InputError(
                f"no row has a number in each of {where}", file=file, remedy="map other columns with --map"
            )
        frame = frame[~missing].reset_index(drop=True)
        notes.append(f"dropped {int(missing.sum())} rows without a number in {where}")
    frame = cleaning.order_rows(frame, notes)
    for item in taken:
        if item.role in _HELD and (gaps := int(frame[item.column].isna().sum())):
            if gaps == len(frame):
                frame = frame.drop(columns=item.column)
                notes.append(f'column "{item.source}" is empty; left out')
            else:
                frame[item.column] = frame.groupby("trial")[item.column].ffill().ffill().bfill()
                notes.append(f"{gaps} gaps in {item.column} hold the value before them")
    first = float(frame["time_s"].iloc[0])
    if abs(first) > 1e7:  # the time of day since 1970, in which a float has no microseconds left
        frame["time_s"] -= first
        notes.append(f"time counts from the first row (it was at {first:.6f} s)")
        frame = cleaning.order_rows(frame, notes)
    return frame


def _remark(
    frame: pd.DataFrame, taken: tuple[Taken, ...], kind: Kind, unwrap: float | None, notes: list[str]
) -> None:
    """What a person should look at before trusting the log."""
    presumed = [item for item in taken if item.why == "presumed"]
    if presumed:
        text = ", ".join(f'"{item.source}" {item.unit.text}' for item in presumed)
        notes.append(f"no unit is named, presumed: {text}; if not so, give --unit {presumed[0].role}=UNIT")
    if any(item.commanded for item in taken):
        notes.append(
            f"the {torque_name(kind)} is COMMANDED, not measured; what the drive fails to deliver "
            "will look like friction"
        )
    position = columns_of(kind)["position"]
    if unwrap is None and position in frame.columns:
        jump = cleaning.wrap_hint(frame[position].to_numpy(dtype=float), frame["trial"].to_numpy())
        if jump:
            notes.append(
                f"the position jumps by {jump:.4g} {si_unit('position', kind)}; "
                "if it wraps, give --unwrap PERIOD"
            )


def _remark_effort(taken: tuple[Taken, ...], axis: Axis, notes: list[str]) -> None:
    """Say what stands for the torque where neither it nor its constant is known."""
    roles = {item.role for item in taken}
    if roles & {"current", "bus_current"} and "torque" not in roles and axis.torque_constant is None:
        notes.append(
            "current is given but no torque constant, so every fit will be in A; pass --torque-constant "
            "(stall torque / stall current of the data sheet), or find it with ffc-id calibrate"
        )
    elif "duty" in roles and not roles & {"torque", "current", "bus_current"}:
        notes.append(
            "there is no current, so the voltage at the motor (duty times supply) stands for its torque; "
            "what the back-EMF takes of it will look like viscous friction"
        )


def _axis(kind: Kind, constant: float | None, old: Axis | None) -> Axis:
    if constant is not None:
        constant = check_constant(constant, argument="torque_constant")
    elif old and old.kind == kind:
        constant = old.torque_constant
    if old and old.kind == kind:
        return replace(old, torque_constant=constant)
    return Axis(kind, constant, old.extra if old else {})


def _provenance(
    file: Path,
    taken: tuple[Taken, ...],
    where: Mapping[str, Sequence[str]] | None,
    trial_by: str | None,
    unwrap: float | None,
) -> dict[str, Any]:
    """What the log's header says of where it came from; the file's name only, so that no path leaks."""
    record: dict[str, Any] = {"imported_from": file.name}
    if any(item.commanded for item in taken):
        record["effort"] = "commanded"
    options: dict[str, Any] = {}
    if where:
        options["where"] = [f"{name}={value}" for name, values in where.items() for value in values]
    if trial_by:
        options["trial_by"] = trial_by
    if unwrap is not None:
        options["unwrap"] = float(unwrap)
    options["columns"] = {item.column: item.source for item in taken}
    converted = {item.column: item.unit.text for item in taken if item.unit.factor != 1 or item.unit.offset}
    if converted:
        options["units"] = converted
    return record | {"import": options}
