"""What is safe to repair in a recording; every repair is counted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError, nearest
from idtool.log.format import columns_of
from idtool.log.table import as_numbers
from idtool.presentation.text import counted

#: Name of the index of a table whose rows are lines of a file.
LINE = "line"
#: Where more of the rows than this share have a time stamp that was there already, it lost its digits.
_ALIKE = 0.9
#: ... and where more than this share, a clock ticks more coarsely than rows come.
_COARSE = 0.25
#: ... if so many of them hold readings of their own: a reading that is logged again and again is one.
_ANEW = 0.5
#: Rows further apart than so many ticks have a pause between them.
_PAUSE = 3.0
#: Rows at a steady pace lie within so many ticks of a line through their stamps, from the first to the last;
#: others follow the line through so many ticks before and after.
_WITHIN = 1.5
_AROUND = 10
#: Names of columns that number or name the servos of a table. A bus has so many at most; rows are more.
_WHICH = re.compile(
    r"(?P<what>(dxl|dynamixel|motor|servo|joint|actuator|axis|drive)s?)?[ _.-]?(?P<id>id)?"
    r"((?<=[a-z])[ _.-]?(index|idx|name|number|nr|no))?",
    re.IGNORECASE,
)
_MOST_AXES = 254
#: Columns that are read from a drive.
_READINGS = {
    columns_of(kind)[role]
    for kind in ("rotary", "linear")
    for role in ("position", "velocity", "torque", "current", "bus_current", "duty")
}


def source_column(frame: pd.DataFrame, name: str, option: str) -> pd.Series[Any]:
    """A column of the recording that an option names.

    Raises:
        InputError: there is none of that name.
    """
    if name not in frame.columns:
        raise InputError(
            f'has no column "{name}"', place=option, remedy=nearest(name, list(frame.columns)[:40])
        )
    return frame[name]


def keep_where(frame: pd.DataFrame, where: Mapping[str, Sequence[str]]) -> pd.DataFrame:
    """The rows in which every named column holds one of its wanted values.

    Raises:
        InputError: no such column, or no row is left.
    """
    for name, wanted in where.items():
        column = source_column(frame, name, f"--where {name}")
        keep = np.zeros(len(frame), dtype=bool)
        for value in wanted:
            keep |= _equal(column, value)
        if not keep.any():
            there = ", ".join(str(value) for value in pd.unique(column)[:8])
            raise InputError(
                f"no row has {name} = {' or '.join(wanted)}",
                place=f"--where {name}",
                remedy=f"it holds {there}",
            )
        frame = frame[keep]
    return frame


def require_single(frame: pd.DataFrame, names: Sequence[str]) -> None:
    """Refuse rows of several axes; which is wanted, `--where` says.

    Raises:
        InputError: a column that tells axes apart holds several values.
    """
    for name in names:
        there = [str(value) for value in pd.unique(frame[name])]
        if len(there) > 1:
            raise InputError(
                f'holds several axes: column "{name}" is {", ".join(there[:8])}',
                remedy=f'choose one with --where "{name}={there[0]}" (trials of one: --trial-by "{name}")',
            )


def which_axis(frame: pd.DataFrame) -> list[str]:
    """Columns that by their names tell one servo of a long table from another ("motor_id", "joint")."""
    found = []
    for name in map(str, frame.columns):
        told = _WHICH.fullmatch(name.strip())
        if told is None or not (told["what"] or told["id"]):
            continue
        several = frame[name].nunique()
        # a bare "id" may number trials, one after another; servos are asked in turn
        turns = told["what"] or int((frame[name] != frame[name].shift()).sum()) > 2 * several
        if turns and several <= min(_MOST_AXES, len(frame) // 2):
            found.append(name)
    return found


def _equal(column: pd.Series[Any], value: str) -> np.ndarray:
    if pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(column):
        try:
            return np.asarray(column == float(value))
        except ValueError:
            return np.zeros(len(column), dtype=bool)
    return np.asarray(column.astype(str).str.strip() == value.strip())


def to_numbers(column: pd.Series[Any], name: str) -> np.ndarray:
    """A column as numbers; NaN where it holds none.

    Raises:
        InputError: it holds no number at all but text.
    """
    if pd.api.types.is_datetime64_any_dtype(column):
        return _seconds(column)
    numbers = as_numbers(column).to_numpy()
    numbers = np.where(np.isfinite(numbers), numbers, np.nan)
    if np.isnan(numbers).all() and column.notna().any():
        shown = str(column[column.notna()].iloc[0])[:40]
        raise InputError(
            f'column "{name}" holds text ("{shown}"), not numbers',
            remedy="map another column to it with --map, or export it as numbers",
        )
    return numbers


def bad_cells(column: pd.Series[Any], numbers: np.ndarray) -> str:
    """What is said of cells of a column that hold something else than finite numbers; "" where none does."""
    bad = np.flatnonzero(np.isnan(numbers) & column.notna().to_numpy())
    if not len(bad):
        return ""
    row = int(bad[0])
    place = f"line {column.index[row]}" if column.index.name == LINE else f"row {row + 1}"
    more = f" (and {len(bad) - 1} more)" if len(bad) > 1 else ""
    return (
        f'column "{column.name}", {place}: "{str(column.iloc[row])[:40]}" is no finite number{more}, '
        "taken as missing"
    )


def date_seconds(column: pd.Series[Any]) -> np.ndarray | None:
    """Dates and times of day as seconds; None if the column holds none."""
    if pd.api.types.is_numeric_dtype(column):
        return None
    if not pd.api.types.is_datetime64_any_dtype(column):
        column = pd.to_datetime(column, errors="coerce", format="ISO8601", utc=True)
        if column.isna().all():
            return None
    return _seconds(column)


def _seconds(column: pd.Series[Any]) -> np.ndarray:
    stamps = column.dt.tz_localize(None) if column.dt.tz is not None else column
    first = stamps.dropna().min()
    seconds: np.ndarray = (stamps - first).dt.total_seconds().to_numpy(dtype=float, na_value=np.nan)
    return seconds


def trial_numbers(column: pd.Series[Any]) -> tuple[np.ndarray, bool]:
    """Trials as whole numbers, and whether they are labels numbered in order of appearance."""
    if pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(column):
        values = column.to_numpy(dtype=float, na_value=np.nan)
        if np.isfinite(values).all() and (values == np.round(values)).all() and np.abs(values).max() < 1e15:
            return values.astype(np.int64), False
    codes, _ = pd.factorize(column.astype(str))
    return codes.astype(np.int64), True


def order_rows(frame: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Rows of a trial together, time rising inside each; a clock that restarts begins a new trial.

    Rows out of order are sorted; rows that are there twice, or whose time stamp was there, are dropped. Where
    many have the stamp of another one the clock is coarser than the rows, which are spread between its ticks.

    Raises:
        InputError: most rows have the time stamp of another one.
    """
    again = frame.duplicated().to_numpy()
    if again.any():
        frame = frame[~again].reset_index(drop=True)
        notes.append(f"dropped {counted(int(again.sum()), 'row')} met before, to the last digit")
    first_seen, _ = pd.factorize(frame["trial"])
    order = np.argsort(first_seen, kind="stable")
    if (np.diff(first_seen) < 0).any():
        frame = frame.iloc[order].reset_index(drop=True)
        notes.append("rows of a trial brought together")
    frame = _split_restarts(frame, notes)
    rank, _ = pd.factorize(frame["trial"])
    time = frame["time_s"].to_numpy(dtype=float)
    order = np.lexsort((np.arange(len(frame)), time, rank))
    late = int(((np.diff(time) < 0) & (np.diff(rank) == 0)).sum())
    if late:
        frame = frame.iloc[order].reset_index(drop=True)
        notes.append(f"sorted by time: {counted(late, 'row')} came out of order")
    repeated = frame.duplicated(["trial", "time_s"]).to_numpy()
    if np.mean(repeated) > _ALIKE:
        raise InputError(
            f"its {len(frame)} rows have {counted(int(np.sum(~repeated)), 'time stamp')} only",
            remedy="export the time with all its digits, or map another column to it with --map",
        )
    if np.mean(repeated) > _COARSE and _read_anew(frame)[repeated].mean() > _ANEW:
        frame = _spread(frame, repeated, notes)
        repeated = frame.duplicated(["trial", "time_s"]).to_numpy()
    if repeated.any():
        frame = frame[~repeated].reset_index(drop=True)
        notes.append(f"dropped {counted(int(repeated.sum()), 'row')} whose time stamp was there already")
    return frame


def _read_anew(frame: pd.DataFrame) -> np.ndarray:
    """Rows in which something else was read than in the one before, shape (rows,)."""
    readings = frame[[name for name in frame.columns if name in _READINGS]].to_numpy()
    return np.concatenate([[True], (readings[1:] != readings[:-1]).any(axis=1)])


def _spread(frame: pd.DataFrame, repeated: np.ndarray, notes: list[str]) -> pd.DataFrame:
    """Rows that share the ticks of a clock, at times of their own."""
    time, trial = (frame[name].to_numpy() for name in ("time_s", "trial"))
    steps = np.diff(time[~repeated])
    tick = float(np.median(steps[np.diff(trial[~repeated]) == 0]))
    begins = np.concatenate([[True], (np.diff(trial) != 0) | (np.diff(time) > _PAUSE * tick)])
    between = frame.groupby(np.cumsum(begins))["time_s"].transform(_between_ticks, tick)
    rows = len(time) / np.count_nonzero(~repeated)
    notes.append(
        f"the clock ticks every {1e3 * tick:.3g} ms, for {rows:.2g} rows each time: they were spread evenly "
        "over time"
    )
    return frame.assign(time_s=between)


def _between_ticks(stamps: pd.Series[Any], tick: float) -> np.ndarray:
    """When rows were read that a coarse clock gave rising stamps: at a steady pace, where that leaves each in
    its tick, or at one that is steady over some ticks."""
    first = float(stamps.iloc[0])
    time, row = stamps.to_numpy(dtype=float) - first, np.arange(len(stamps), dtype=float)
    if not time.any():
        return time + first
    steady = np.polyval(np.polyfit(row, time, 1), row)
    if np.ptp(time - steady) <= _WITHIN * tick:
        return np.asarray(first + steady)
    ticks = np.searchsorted(np.unique(time), time)
    # a line through the rows of the ticks around each, which rises as they do
    begin = np.searchsorted(ticks, ticks - _AROUND, "left")
    end = np.searchsorted(ticks, ticks + _AROUND, "right")
    sums = [np.concatenate([[0.0], np.cumsum(each)]) for each in (row, time, row * row, row * time)]
    count = end - begin
    x, y, xx, xy = (one[end] - one[begin] for one in sums)
    slope = (count * xy - x * y) / np.maximum(count * xx - x * x, 1.0)
    return np.asarray(first + np.maximum.accumulate((y + slope * (count * row - x)) / count))


def _split_restarts(frame: pd.DataFrame, notes: list[str]) -> pd.DataFrame:
    """Number the trials anew where the clock falls back past the middle of what it had run."""
    time = frame["time_s"].to_numpy(dtype=float)
    trial = frame["trial"].to_numpy()
    changed = np.concatenate([[True], trial[1:] != trial[:-1]])
    falls = np.flatnonzero((time[1:] < time[:-1]) & ~changed[1:]) + 1
    starts = np.flatnonzero(changed)
    restarts: list[int] = []
    begin = 0
    for row in falls:
        begin = max(begin, int(starts[np.searchsorted(starts, row, side="right") - 1]))
        if time[row] <= time[begin] + 0.5 * (time[row - 1] - time[begin]):
            restarts.append(int(row))
            begin = int(row)
    if not restarts:
        return frame
    changed[restarts] = True
    notes.append(
        f"the clock starts again {counted(len(restarts), 'time')} inside a trial: each begins a new trial"
    )
    return frame.assign(trial=np.cumsum(changed) - 1)


def wrap_hint(position: np.ndarray, trial: np.ndarray) -> float | None:
    """The size of the jumps if a position looks like one that wraps, else None."""
    step = np.abs(np.diff(position))[np.diff(trial) == 0]
    span = float(np.ptp(position)) if len(position) else 0.0
    if len(step) < 20 or span <= 0 or step.max() < 0.8 * span or np.median(step) > 0.05 * span:
        return None
    return float(np.median(step[step > 0.8 * span]))
