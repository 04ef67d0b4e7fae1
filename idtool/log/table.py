"""The rows of a log: read, and checked one rule after another.

Nothing here loops over rows while they are good; only the search for the line to name in a message does.
"""

from __future__ import annotations

import io
import math
import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from idtool.errors import InputError, nearest
from idtool.log.format import columns_of
from idtool.log.text import LogText, nameless, not_text
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


def parse_rows(text: LogText) -> pd.DataFrame:
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
        raise not_text() from error
    except (pd.errors.ParserError, ValueError, OverflowError) as error:
        raise InputError(f"is not a CSV table ({str(error).strip()})", remedy="correct that place") from error
    if len(frame) != len(text.ends):
        raise InputError("is not a CSV table (a quote is not closed)", remedy="remove or close the quote")
    return frame


def without_row_numbers(frame: pd.DataFrame, text: LogText) -> tuple[pd.DataFrame, bool]:
    """The table without the row numbers that pandas' `to_csv` puts first, and whether there were any.

    Raises:
        InputError: a first column without a name that holds anything else.
    """
    if text.names[0]:
        return frame, False
    import pandas as pd

    numbers = frame.iloc[:, 0]
    if not pd.api.types.is_integer_dtype(numbers) or (numbers < 0).any():
        raise nameless(0, text.first_line - 1)
    return frame.iloc[:, 1:].copy(), True


def check_rows(frame: pd.DataFrame, axis: Axis, text: LogText | None) -> pd.DataFrame:
    """The table with every needed column there, numbers finite and rows in order; `trial` added if absent.

    Args:
        frame: the rows, columns named as in the file.
        axis: the axis they belong to.
        text: where they were read from; None for a table made in memory.

    Raises:
        InputError: naming the column and the line.
    """
    roles = columns_of(axis.kind)
    columns = set(frame.columns)
    check_names(columns, axis.kind)
    for name in roles.values():
        if name in columns and name != "trial":
            frame[name] = _numeric(frame[name], name, text)
    if "trial" not in columns:
        frame.insert(0, "trial", 0)
    elif frame["trial"].isna().any():
        _numeric(frame["trial"].where(frame["trial"].isna(), 0), "trial", text)
    there = [name for name in roles.values() if name in frame.columns]
    check_values({name: frame[name].to_numpy() for name in there}, text)
    return frame


def check_names(columns: set[str], kind: Kind) -> None:
    """Refuse a table without a column that a log needs.

    Raises:
        InputError: naming the column.
    """
    roles = columns_of(kind)
    _need(columns, ["time"], roles)
    _need(columns, ["velocity", "position"], roles)
    _need(columns, ["current", "torque", "bus_current", "duty"], roles)
    _check_drive(columns)


def check_values(columns: Mapping[str, np.ndarray], text: LogText | None) -> None:
    """Refuse rows that are out of order, and values that a column cannot hold in its unit.

    Args:
        columns: those with a meaning; the time and the trial among them, shape (rows,) each.
        text: where they were read from; None for a table made in memory.

    Raises:
        InputError: naming the column and the line.
    """
    _check_order(columns["trial"], columns["time_s"], text)
    _check_ranges(columns, text)


def _check_drive(columns: set[str]) -> None:
    """The columns that tell of a drive whose motor current nobody measured."""
    measured = columns & {"torque_nm", "force_n", "current_a"}
    if "bus_current_a" in columns and not measured and "duty" not in columns:
        raise InputError(
            'column "bus_current_a" is the current of the supply, which is not the motor\'s',
            remedy='add column "duty" (the motor has the supply\'s current over the duty)',
        )
    if "duty" in columns and not measured | (columns & {"bus_current_a", "supply_voltage_v"}):
        raise InputError(
            'column "duty" says nothing of the motor without the voltage of the supply',
            remedy='add column "supply_voltage_v"',
        )


def _check_ranges(columns: Mapping[str, np.ndarray], text: LogText | None) -> None:
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
                f'column "{name}" holds {values[row]:g}, not {wanted}', place=_place(text, row), remedy=remedy
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


def _need(columns: set[str], any_of: list[str], roles: Mapping[str, str]) -> None:
    names = [roles[role] for role in any_of]
    if columns & set(names):
        return
    wanted = " or ".join(f'"{name}"' for name in names)
    for column in sorted(columns):
        role = _UNITLESS.get(column.lower())
        if role in any_of:
            raise InputError(
                f'column "{column}" has no unit',
                remedy=f'name it "{roles[role]}" if that is its unit, {_IMPORT}',
            )
    free = sorted(columns - set(roles.values()))
    for name in names:
        guess = nearest(name, free) if free else ""
        if guess.startswith("did you mean "):
            found = guess.removeprefix("did you mean ")
            raise InputError(
                f"needs a column {wanted}",
                remedy=f'rename {found} if that is it and its unit is the one in "{name}", {_IMPORT}',
            )
    raise InputError(f"needs a column {wanted}", remedy=f"rename the column that is it, {_IMPORT}")


def as_numbers(values: pd.Series[Any]) -> pd.Series[float]:
    """A column as floats: NaN where it holds no number, inf where the number is larger than a float."""
    import pandas as pd

    try:
        numbers = pd.to_numeric(values, errors="coerce")
    except OverflowError:  # a whole number of more than 308 digits
        numbers = pd.to_numeric(values.astype(str), errors="coerce")
    return pd.Series(numbers.to_numpy(dtype=float, na_value=np.nan), values.index, name=values.name)


def _numeric(values: pd.Series[Any], name: str, text: LogText | None) -> pd.Series[float]:
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
            f'column "{name}" {shown}', place=_place(text, row), remedy=_remedy(len(bad), len(numbers))
        )
    return numbers


def _remedy(bad: int, rows: int) -> str:
    if bad == rows > 1:
        return "no row of it is: leave the column out, or `ffc-id import` the file"
    return "correct or delete that row" + (f" ({bad} such)" if bad > 1 else "")


def _place(text: LogText | None, row: int) -> str:
    return f"line {text.line(row)}" if text else f"row {row + 1}"


def _check_order(trial: np.ndarray, time: np.ndarray, text: LogText | None) -> None:
    known = set()
    for row in (0, *(np.flatnonzero(trial[1:] != trial[:-1]) + 1).tolist()):
        if trial[row] in known:
            raise InputError(
                f"trial {trial[row]} starts again",
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
            place=_place(text, row),
            remedy=f"sort or remove such rows ({int(back.sum())} in all); `ffc-id import` can do it",
        )
