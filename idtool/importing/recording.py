"""From a recording to a log: choose columns, convert, clean, and keep account of all of it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError, UsageError, in_file
from idtool.importing import choosing, cleaning
from idtool.importing.conversion import in_volts, si_unit
from idtool.importing.names import NEEDED, Meaning, Taken, check_kind, choose_kind, role_of
from idtool.importing.sources import read_table
from idtool.log import Log
from idtool.log.columns import Columns
from idtool.log.effort import effort_of
from idtool.log.format import columns_of
from idtool.log.repair import repair
from idtool.model.units import Kind, torque_name
from idtool.parameters.axis import Axis, check_constant
from idtool.presentation.text import counted

#: A supply that nobody told is said to be so many times the largest voltage at the motor.
_HEADROOM = 1.25
#: Roles that change slowly or stay until set anew, so that a gap holds the last value.
_HELD = (
    "payload", "tilt_alpha", "tilt_beta", "temperature", "supply_voltage", "position_command",
    "velocity_command", "drive_on",
)  # fmt: skip


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

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What a fit of the log would refuse, or find to contradict itself: a wrong unit, a wrong sign."""
        whose = f"{self.log.source}: "
        try:
            effort = effort_of(self.log)
            found = repair(self.log, Columns.of(self.log, effort), effort).wiring
        except InputError as error:
            found = (str(error),)
        return tuple(one.removeprefix(whose) for one in found)


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
    with in_file(file):
        table = cleaning.keep_where(source.frame, where or {})
        parted = {trial_by, (mapping or {}).get("trial")}
        telling = source.single or [name for name in cleaning.which_axis(table) if name not in parted]
        cleaning.require_single(table, telling)
        stated: dict[str, Kind] = {f"--kind {kind}": kind} if kind else {}
        chosen, given = choosing.given(source, table, mapping or {}, stated)
        old_axis = Axis.from_table(header["axis"]) if "axis" in header else None
        if old_axis and not stated:
            stated["its [axis] table"] = old_axis.kind
        others = [str(name) for name in table.columns if name not in given]
        free = [m for name in others if (m := choosing.meaning_of(source, name))]
        by_unit = choosing.by_unit(source, others)
        named = [*free, *chosen.values()]
        moves = any(m.role in ("position", "velocity") and not m.commanded for m in named)
        axis_kind = choose_kind(named if moves else [*named, *by_unit], stated)
        check_kind(chosen.values(), axis_kind)
        choosing.fill(chosen, free, by_unit, axis_kind)
        if trial_by:
            cleaning.source_column(table, trial_by, "--trial-by")
            chosen["trial"] = Meaning(trial_by, "trial")
        choosing.drop_empty(chosen, table, notes)
        choosing.require(chosen, table, axis_kind)
        # a role ("current") says no unit, a column of a log ("current_a") does
        given -= {column for left, column in (mapping or {}).items() if left == role_of(left)[0]}
        taken = choosing.with_units(chosen, given, units or {}, source.presumed, axis_kind, table)
        frame, kept = _convert(table, taken, axis_kind, unwrap, notes)
        axis = _axis(axis_kind, torque_constant, old_axis)
        rows = len(frame)
        frame = _clean(frame, taken, notes)
        _remark(frame, taken, axis_kind, unwrap, notes)
        _remark_effort(taken, axis, notes)
        experiment = experiment or source.experiment or str(header.get("experiment", ""))
        provenance = _provenance(file, taken, where, trial_by, unwrap) | source.facts
        log = Log(frame, axis, experiment, provenance, str(file))
        return Imported(log, taken, tuple(kept), tuple(notes), rows)


def _convert(
    table: pd.DataFrame, taken: tuple[Taken, ...], kind: Kind, unwrap: float | None, notes: list[str]
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
        values = cleaning.to_numbers(source, item.source)
        columns[item.column] = values * item.unit.factor + item.unit.offset
        if bad := cleaning.bad_cells(source, values):
            notes.append(bad)
    if any(item.role == "duty" and in_volts(item.unit) for item in taken):
        _as_share(columns, columns_of(kind), notes)
    used = {item.source for item in taken} - set(labels)
    reserved = set(columns_of(kind).values())
    kept = [str(name) for name in table.columns if name not in used]
    for name in kept:
        columns[f"source_{name}" if name in reserved else name] = table[name].to_numpy()
    frame = pd.DataFrame(columns)
    if unwrap is not None:
        _unwrap(frame, columns_of(kind)["position"], unwrap, taken, notes)
    return frame, kept


def _as_share(columns: dict[str, Any], names: Mapping[str, str], notes: list[str]) -> None:
    """The duty of a voltage at the motor: its share of the supply, or of more than it ever is, where nobody
    tells the supply."""
    volts = np.asarray(columns[names["duty"]], dtype=float)
    supply = columns.get(names["supply_voltage"])
    if supply is None:
        supply = float(f"{_HEADROOM * np.nanmax(np.abs(volts), initial=0.0):.3g}") or 1.0
        columns[names["supply_voltage"]] = np.full(len(volts), supply)
        notes.append(
            f"the duty is the motor's voltage as a share of {supply:g} V, which is more than it ever is; map "
            "the supply's voltage, if it was recorded, so that a drive at its limit is seen"
        )
    columns[names["duty"]] = volts / supply


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
    notes.append(f"unwrapped {counted(jumps, 'jump')} of the position with period {period:g} {unit.text}")


def _clean(frame: pd.DataFrame, taken: tuple[Taken, ...], notes: list[str]) -> pd.DataFrame:
    core = [item.column for item in taken if item.role in NEEDED]
    missing = frame[core].isna().any(axis=1).to_numpy()
    if missing.any():
        where = ", ".join(name for name in core if frame[name].isna().any())
        if missing.all():
            raise InputError(f"no row has a number in each of {where}", remedy="map other columns with --map")
        frame = frame[~missing].reset_index(drop=True)
        notes.append(f"dropped {counted(int(missing.sum()), 'row')} without a number in {where}")
    frame = cleaning.order_rows(frame, notes)
    for item in taken:
        if item.role in _HELD and (gaps := int(frame[item.column].isna().sum())):
            if gaps == len(frame):
                frame = frame.drop(columns=item.column)
                notes.append(f'column "{item.source}" is empty; left out')
            else:
                frame[item.column] = frame.groupby("trial")[item.column].ffill().ffill().bfill()
                notes.append(f"{item.column}: {counted(gaps, 'gap')} filled with the value before")
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
    commanded = {"effort": "commanded"} if any(item.commanded for item in taken) else {}
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
    return {"imported_from": file.name, **commanded, "import": options}
