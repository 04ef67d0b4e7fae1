"""Where a log keeps its rows: as numbers, until somebody asks for a frame of pandas.

A fit reads columns of numbers, and importing pandas takes longer than many a fit.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError, in_file
from idtool.log.format import columns_of
from idtool.log.table import check_names, check_rows, check_values, parse_rows, without_row_numbers
from idtool.log.text import LogText
from idtool.parameters.axis import Axis

if TYPE_CHECKING:
    import pandas as pd

#: Bytes up to which numpy reads rows sooner than pandas, which reads faster, is imported.
_SHORT = 8_000_000
#: Whole numbers beyond this are not all floats.
_WHOLE = 2.0**53


@dataclass(frozen=True)
class Numbers:
    """The rows of a log file that holds finite numbers only.

    Attributes:
        text: the file.
        axis: of which the log is.
        file: for messages.
        columns: name -> values, shape (rows,).
    """

    text: LogText
    axis: Axis
    file: Path
    columns: Mapping[str, NDArray[np.float64]]

    @classmethod
    def of(cls, text: LogText, axis: Axis, file: Path) -> Numbers | None:
        """The rows of a file; None of one that is long, holds words or gaps, or is not a log: the frame has a
        sentence for each of these."""
        if len(text.rows) > _SHORT or not all(text.names):
            return None
        try:
            check_names(set(text.names), axis.kind)
            values = _numbers(text.rows, len(text.names))
            columns = dict(zip(text.names, np.ascontiguousarray(values), strict=True))
            columns.setdefault("trial", np.zeros(values.shape[1]))
            roles = columns_of(axis.kind).values()
            check_values({name: columns[name] for name in roles if name in columns}, text)
        except (ValueError, InputError):
            return None
        whole = values.shape[1] == len(text.ends) and np.abs(columns["trial"]).max() < _WHOLE
        if not whole or not np.isfinite(values).all():
            return None
        for column in columns.values():
            column.flags.writeable = False  # as the columns of a frame
        return cls(text, axis, file, columns)

    @cached_property
    def frame(self) -> pd.DataFrame:
        """The rows as pandas reads them, whole numbers as such; once made, its values are the log's."""
        with in_file(self.file):
            return frame_of(self.text, self.axis)[0]

    @property
    def latest(self) -> pd.DataFrame | Numbers:
        """The frame where it was made, which may have been written into since."""
        return self.frame if "frame" in vars(self) else self


def frame_of(text: LogText, axis: Axis) -> tuple[pd.DataFrame, bool]:
    """The rows of a log file, and whether a column without a name numbered them.

    Raises:
        InputError: naming the column and the line.
    """
    table, numbered = without_row_numbers(parse_rows(text), text)
    return check_rows(table, axis, text), numbered


def _numbers(rows: bytes, columns: int) -> NDArray[np.float64]:
    """Shape (columns, rows).

    Raises:
        ValueError: something else is among them.
    """
    if "numba" in sys.modules:  # whose import takes longer than numpy's reader
        from idtool.log.digits import read_digits

        if (found := read_digits(rows, columns)) is not None:
            return found
    return np.loadtxt(io.BytesIO(rows), delimiter=",", comments=None, ndmin=2, unpack=True)


def row_count(rows: pd.DataFrame | Numbers) -> int:
    """How many rows there are."""
    return len(rows.columns["trial"]) if isinstance(rows, Numbers) else len(rows)


def values_of(rows: pd.DataFrame | Numbers, name: str) -> NDArray[np.float64]:
    """A column as floats, shape (rows,)."""
    return rows.columns[name] if isinstance(rows, Numbers) else rows[name].to_numpy(dtype=float)


def trial_of_rows(rows: pd.DataFrame | Numbers) -> NDArray[np.intp]:
    """The trial of every row, counted from 0 as they come, shape (rows,)."""
    if isinstance(rows, Numbers):
        trial = rows.columns["trial"]
        return np.asarray(np.cumsum(np.diff(trial, prepend=trial[0]) != 0), dtype=np.intp)
    return np.asarray(rows.groupby("trial", sort=False).ngroup(), dtype=np.intp)
