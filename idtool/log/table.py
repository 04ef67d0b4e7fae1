"""The rows of a log: read, and checked one rule after another.

Nothing here loops over rows while they are good; only the search for the line to name in a message does.
"""

from __future__ import annotations

import csv
import io
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from idtool.errors import InputError, nearest
from idtool.io.read_file import MAX_LINE, read_bytes
from idtool.log.format import columns_of
from idtool.model.motor import MOST_SUPPLY_V
from idtool.model.units import Kind
from idtool.parameters.axis import Axis

if TYPE_CHECKING:
    import pandas as pd

#: Names people give to a column when they leave the unit out -> the role they mean.
_UNITLESS = {
    **dict.fromkeys(("time", "t", "timestamp"), "time"),
    **dict.fromkeys(("position", "pos", "q", "angle"), "position"),
    **dict.fromkeys(("velocity", "vel", "speed", "dq"), "velocity"),
    **dict.fromkeys(("current", "i", "iq"), "current"),
    **dict.fromkeys(("torque", "tau", "force"), "torque"),
    **dict.fromkeys(("pwm", "load"), "duty"),
}
_IMPORT = "or use `ffc-id import --map`"


@dataclass(frozen=True)
class LogText:
    """A log file taken apart, its rows not read yet.

    Attributes:
        comments: the leading `#` lines, without `# `.
        names: the columns.
        rows: the data rows, each ended by a newline.
        ends: position of each row's last byte (its newline) in `rows`.
        first_line: line number of the first data row, as an editor counts.
        incomplete: the file was cut short and its last, partial row is left out.
    """

    comments: list[str]
    names: list[str]
    rows: bytes
    ends: np.ndarray
    first_line: int
    incomplete: bool

    @property
    def line_of_rows(self) -> int:
        """The line of the first row, where every row is a line; 0 where quoted text holds line breaks."""
        return self.first_line if self.rows.count(b"\n") == len(self.ends) else 0

    def line(self, row: int) -> int:
        """The line number of a data row; quoted text may hold line breaks of its own."""
        start = int(self.ends[row - 1]) + 1 if row else 0
        return self.first_line + self.rows.count(b"\n", 0, start)


def read_text(file: Path) -> LogText:
    """Take a log file apart.

    Raises:
        InputError: not readable, not text, no header row, no data rows, rows of unequal length.
    """
    raw, cut = read_bytes(file, what="a log", text=True)
    raw = raw.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n")
    if b"\n" not in raw:
        raw = raw.replace(b"\r", b"\n")
    if raw.endswith(b"\0"):  # a power cut leaves zeros where the data never arrived
        raw, cut = raw.rstrip(b"\0"), True
    if b"\0" in raw:
        raise _not_text(file)
    if not raw.strip():
        raise InputError("the file is empty", file=file, remedy="record it again")
    if file.suffix == ".toml":
        raise InputError("is a TOML file and no log", file=file, remedy="pass the CSV file of a run")
    comments, start = _comments(raw, file)
    line_end = raw.find(b"\n", start)
    names = _names(raw[start:] if line_end < 0 else raw[start:line_end], len(comments) + 1, file)
    rows = raw[line_end + 1 :] if line_end >= 0 else b""
    # In a log of ours a last line without its newline was cut, even if all its fields are there: its
    # last number may lack digits. Elsewhere many programs leave that newline out.
    ours = cut or any(line.startswith("ffc-id-log") for line in comments)
    quoted = rows.count(b'"')
    rows, ends, dropped = _whole_rows(rows, len(names), drop_unended=ours)
    if not len(ends) and quoted % 2:
        raise InputError("a quote is not closed", file=file, remedy="remove or close the quote")
    if not len(ends):
        raise InputError("has no data rows", file=file, remedy="record it again")
    text = LogText(comments, names, rows, ends, len(comments) + 2, cut or dropped)
    _check_lengths(text, file)
    return text


def _not_text(file: Path) -> InputError:
    return InputError(
        "is not a text file in UTF-8",
        file=file,
        remedy="`ffc-id import` reads other encodings, Parquet and MATLAB files",
    )


def _comments(raw: bytes, file: Path) -> tuple[list[str], int]:
    """The leading `#` lines without `# `, and where the rest starts."""
    start = 0
    lines: list[str] = []
    while raw.startswith(b"#", start):
        end = raw.find(b"\n", start)
        end = len(raw) if end < 0 else end
        if end - start > MAX_LINE:
            raise InputError(
                "a line of over 1 MiB is no log",
                file=file,
                place=f"line {len(lines) + 1}",
                remedy="check the path",
            )
        try:
            lines.append(raw[start + 1 : end].decode().removeprefix(" "))
        except UnicodeDecodeError as error:
            raise _not_text(file) from error
        start = end + 1
    return lines, start


def _names(line: bytes, number: int, file: Path) -> list[str]:
    place = f"line {number}"
    if len(line) > MAX_LINE:
        raise InputError("a line of over 1 MiB is no log", file=file, place=place, remedy="check the path")
    try:
        text = line.decode()
        names = [name.strip() for name in next(csv.reader([text], skipinitialspace=True), [])]
    except UnicodeDecodeError as error:
        raise _not_text(file) from error
    except csv.Error as error:
        raise InputError(
            f"the header row is not CSV ({error})", file=file, place=place, remedy="correct that line"
        ) from error
    if not any(names):
        raise InputError(
            "has no header row", file=file, place=place, remedy="the first row must name the columns"
        )
    if all(is_number(name) for name in names):
        raise InputError(
            "the header row is missing, the rows start at once",
            file=file,
            place=place,
            remedy="name the columns in a row above them",
        )
    if len(names) == 1 and (";" in text or "\t" in text):
        raise InputError(
            "the columns are not separated by commas",
            file=file,
            place=place,
            remedy="`ffc-id import` reads such files",
        )
    if "" in names[1:]:
        raise _nameless(names.index("", 1), number, file)
    doubled = sorted(name for name in set(names) if names.count(name) > 1)
    if doubled:
        raise InputError(
            f'column "{doubled[0]}" appears twice', file=file, place=place, remedy="rename or remove one"
        )
    return names


def _nameless(column: int, number: int, file: Path) -> InputError:
    return InputError(
        f"column {column + 1} has no name",
        file=file,
        place=f"line {number}",
        remedy="name it or remove it",
    )


def is_number(text: str) -> bool:
    """Whether a cell of a table holds a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _whole_rows(rows: bytes, width: int, *, drop_unended: bool) -> tuple[bytes, np.ndarray, bool]:
    """Rows without a half-written last one, the position of each row's end, and whether one was dropped."""
    dropped = False
    if rows and not rows.endswith(b"\n"):
        if drop_unended:
            rows, dropped = rows[: rows.rfind(b"\n") + 1], True
        else:
            rows += b"\n"
    rows = rows.rstrip(b"\n") + b"\n" if rows.strip(b"\n") else b""
    ends = _outside_quotes(rows, b"\n")
    if len(ends) and rows.count(b",", int(ends[-2]) + 1 if len(ends) > 1 else 0) < width - 1:
        ends, dropped = ends[:-1], True
        rows = rows[: int(ends[-1]) + 1] if len(ends) else b""
    elif rows and not len(ends):  # a quote that never closes: the cut went through it
        rows, dropped = b"", True
    return rows, ends, dropped


def _outside_quotes(rows: bytes, mark: bytes) -> np.ndarray:
    """Positions of a one-byte mark that is not inside quoted text."""
    data = np.frombuffer(rows, np.uint8)
    found = np.flatnonzero(data == mark[0])
    if b'"' in rows:
        quotes = np.flatnonzero(data == ord('"'))
        found = found[np.searchsorted(quotes, found) % 2 == 0]
    return found


def _check_lengths(text: LogText, file: Path) -> None:
    fields = np.diff(np.searchsorted(_outside_quotes(text.rows, b","), text.ends), prepend=0) + 1
    wrong = np.flatnonzero(fields != len(text.names))
    if len(wrong):
        row = int(wrong[0])
        start = int(text.ends[row - 1]) + 1 if row else 0
        blank = not text.rows[start : int(text.ends[row])].strip()
        raise InputError(
            "the line is empty" if blank else f"has {fields[row]} fields, expected {len(text.names)}",
            file=file,
            place=f"line {text.line(row)}",
            remedy=f"correct or delete that line ({len(wrong)} such)"
            if len(wrong) > 1
            else "correct or delete that line",
        )


def parse_rows(text: LogText, file: Path) -> pd.DataFrame:
    """The table; columns that are numbers throughout as numbers, others as text.

    Raises:
        InputError: not CSV, or not UTF-8.
    """
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a column of mixed types is told of below, by its line
            frame = pd.read_csv(
                io.BytesIO(text.rows),
                header=None,
                names=text.names,
                index_col=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                lineterminator="\n",
                low_memory=False,
            )
    except UnicodeDecodeError as error:
        raise _not_text(file) from error
    except (pd.errors.ParserError, ValueError, OverflowError) as error:
        raise InputError(
            f"is not a CSV table ({str(error).strip()})", file=file, remedy="correct that place"
        ) from error
    if len(frame) != len(text.ends):
        raise InputError(
            "is not a CSV table (a quote is not closed)", file=file, remedy="remove or close the quote"
        )
    return frame


def without_row_numbers(frame: pd.DataFrame, text: LogText, file: Path) -> tuple[pd.DataFrame, bool]:
    """The table without the row numbers that pandas' `to_csv` puts first, and whether there were any.

    Raises:
        InputError: a first column without a name that holds anything else.
    """
    if text.names[0]:
        return frame, False
    import pandas as pd

    numbers = frame.iloc[:, 0]
    if not pd.api.types.is_integer_dtype(numbers) or (numbers < 0).any():
        raise _nameless(0, text.first_line - 1, file)
    return frame.iloc[:, 1:].copy(), True


def check_rows(frame: pd.DataFrame, axis: Axis, text: LogText | None, file: Path) -> pd.DataFrame:
    """The table with every needed column there, numbers finite and rows in order; `trial` added if absent.

    Args:
        frame: the rows, columns named as in the file.
        axis: the axis they belong to.
        text: where they were read from; None for a table made in memory.
        file: for messages.

    Raises:
        InputError: naming the column and the line.
    """
    roles = columns_of(axis.kind)
    columns = set(frame.columns)
    check_names(columns, axis.kind, file)
    for name in roles.values():
        if name in columns and name != "trial":
            frame[name] = _numeric(frame[name], name, text, file)
    if "trial" not in columns:
        frame.insert(0, "trial", 0)
    elif frame["trial"].isna().any():
        _numeric(frame["trial"].where(frame["trial"].isna(), 0), "trial", text, file)
    there = [name for name in roles.values() if name in frame.columns]
    check_values({name: frame[name].to_numpy() for name in there}, text, file)
    return frame


def check_names(columns: set[str], kind: Kind, file: Path) -> None:
    """Refuse a table without a column that a log needs.

    Raises:
        InputError: naming the column.
    """
    roles = columns_of(kind)
    _need(columns, ["time"], roles, file)
    _need(columns, ["velocity", "position"], roles, file)
    _need(columns, ["current", "torque", "bus_current", "duty"], roles, file)
    _check_drive(columns, file)


def check_values(columns: Mapping[str, np.ndarray], text: LogText | None, file: Path) -> None:
    """Refuse rows that are out of order, and values that a column cannot hold in its unit.

    Args:
        columns: those with a meaning; the time and the trial among them, shape (rows,) each.
        text: where they were read from; None for a table made in memory.
        file: for messages.

    Raises:
        InputError: naming the column and the line.
    """
    _check_order(columns["trial"], columns["time_s"], text, file)
    _check_ranges(columns, text, file)


def _check_drive(columns: set[str], file: Path) -> None:
    """The columns that tell of a drive whose motor current nobody measured."""
    measured = columns & {"torque_nm", "force_n", "current_a"}
    if "bus_current_a" in columns and not measured and "duty" not in columns:
        raise InputError(
            'column "bus_current_a" is the current of the supply, which is not the motor\'s',
            file=file,
            remedy='add column "duty" (the motor has the supply\'s current over the duty)',
        )
    if "duty" in columns and not measured | (columns & {"bus_current_a", "supply_voltage_v"}):
        raise InputError(
            'column "duty" says nothing of the motor without the voltage of the supply',
            file=file,
            remedy='add column "supply_voltage_v"',
        )


def _check_ranges(columns: Mapping[str, np.ndarray], text: LogText | None, file: Path) -> None:
    for name, low, high, wanted, remedy in _RANGES:
        if name not in columns:
            continue
        values = columns[name]
        bad = np.flatnonzero((values < low) | (values > high))
        if name == "drive_on":
            bad = np.flatnonzero(~np.isin(values, (0.0, 1.0)))
        if len(bad):
            row = int(bad[0])
            raise InputError(
                f'column "{name}" holds {values[row]:g}, not {wanted}',
                file=file,
                place=_place(text, row),
                remedy=remedy,
            )


#: What a share of 1 may be off by for its rounding.
ROUNDING = 1e-3
#: No tilt is beyond a turn, rad.
_TURN = 2.0 * math.pi + ROUNDING
#: No winding is whole at this temperature, degC (copper melts at 1085).
_HOTTEST = 1000.0
#: Column, the least and the most that it may hold, what it should hold, and what to do.
_RANGES = (
    (
        "duty",
        -1.0 - ROUNDING,
        1.0 + ROUNDING,
        "a share from -1 to 1: it is in per cent or in counts",
        "divide it by its full scale (`ffc-id import --unit duty=percent`, or duty=count:885)",
    ),
    ("drive_on", 0.0, 1.0, "0 (off) or 1 (on)", "correct it"),
    (
        "supply_voltage_v",
        0.0,
        MOST_SUPPLY_V,
        "the voltage of a drive's supply: it may be in millivolts",
        "turn it into volts (`ffc-id import --unit supply_voltage=mV`)",
    ),
    ("payload_kg", 0.0, math.inf, "a mass", "write what hangs on the axis, 0 where nothing does"),
    ("temperature_degc", -273.15, _HOTTEST, "a temperature", "correct it, or remove the column"),
    *(
        (
            f"tilt_{which}_rad",
            -_TURN,
            _TURN,
            "an angle within a turn: it is in degrees",
            f"turn it into radians (`ffc-id import --unit tilt_{which}=deg`)",
        )
        for which in ("alpha", "beta")
    ),
)


def _need(columns: set[str], any_of: list[str], roles: Mapping[str, str], file: Path) -> None:
    names = [roles[role] for role in any_of]
    if columns & set(names):
        return
    wanted = " or ".join(f'"{name}"' for name in names)
    for column in sorted(columns):
        role = _UNITLESS.get(column.lower())
        if role in any_of:
            raise InputError(
                f'column "{column}" has no unit',
                file=file,
                remedy=f'name it "{roles[role]}" if that is its unit, {_IMPORT}',
            )
    free = sorted(columns - set(roles.values()))
    for name in names:
        guess = nearest(name, free) if free else ""
        if guess.startswith("did you mean "):
            found = guess.removeprefix("did you mean ")
            raise InputError(
                f"needs a column {wanted}",
                file=file,
                remedy=f'rename {found} if that is it and its unit is the one in "{name}", {_IMPORT}',
            )
    raise InputError(f"needs a column {wanted}", file=file, remedy=f"rename the column that is it, {_IMPORT}")


def as_numbers(values: pd.Series[Any]) -> pd.Series[float]:
    """A column as floats: NaN where it holds no number, inf where the number is larger than a float."""
    import pandas as pd

    try:
        numbers = pd.to_numeric(values, errors="coerce")
    except OverflowError:  # a whole number of more than 308 digits
        numbers = pd.to_numeric(values.astype(str), errors="coerce")
    return pd.Series(numbers.to_numpy(dtype=float, na_value=np.nan), values.index, name=values.name)


def _numeric(values: pd.Series[Any], name: str, text: LogText | None, file: Path) -> pd.Series[float]:
    import pandas as pd

    if pd.api.types.is_bool_dtype(values):  # TRUE and FALSE are words here, not 1 and 0
        values = values.astype(str)
    numbers = as_numbers(values)
    bad = np.flatnonzero(~np.isfinite(numbers.to_numpy()))
    if len(bad):
        row = int(bad[0])
        word = str(values.iloc[row])[:40]
        shown = "is empty or NaN" if word.lower() in ("nan", "") else f'holds "{word}", not a finite number'
        raise InputError(
            f'column "{name}" {shown}',
            file=file,
            place=_place(text, row),
            remedy=_remedy(len(bad), len(numbers)),
        )
    return numbers


def _remedy(bad: int, rows: int) -> str:
    if bad == rows > 1:
        return "no row of it is: leave the column out, or `ffc-id import` the file"
    return "correct or delete that row" + (f" ({bad} such)" if bad > 1 else "")


def _place(text: LogText | None, row: int) -> str:
    return f"line {text.line(row)}" if text else f"row {row + 1}"


def _check_order(trial: np.ndarray, time: np.ndarray, text: LogText | None, file: Path) -> None:
    known = set()
    for row in (0, *(np.flatnonzero(trial[1:] != trial[:-1]) + 1).tolist()):
        if trial[row] in known:
            raise InputError(
                f"trial {trial[row]} starts again",
                file=file,
                place=_place(text, row),
                remedy="keep the rows of a trial together; `ffc-id import` can do it",
            )
        known.add(trial[row])
    back = (time[1:] <= time[:-1]) & (trial[1:] == trial[:-1])
    if back.any():
        row = int(np.flatnonzero(back)[0]) + 1
        verb = "stands still" if time[row] == time[row - 1] else "goes backwards"
        raise InputError(
            f"time {verb} ({time[row - 1]:.10g} s, then {time[row]:.10g} s)",
            file=file,
            place=_place(text, row),
            remedy=f"sort or remove such rows ({int(back.sum())} in all); `ffc-id import` can do it",
        )
