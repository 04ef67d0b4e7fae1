"""The one log: a CSV file per experiment, TOML lines on top.

A log is a table with one row per sample. Its columns carry their units in their names; which are
needed and which are known is in `columns_of`. Every other column is kept as it is.

    log = Log.read("sweep.csv")
    log.frame      # pandas, file column names
    log.trials     # list of frames, one per trial

`LogWriter` appends while an experiment runs; what it has flushed survives a kill. `Log.write`
writes a finished log whole or not at all.
"""

from __future__ import annotations

import gzip
import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from idtool.errors import in_file
from idtool.io.atomic import atomic_write, refuse_existing, write_whole
from idtool.log.format import TOP_KEYS, columns_of, header_axis, header_text, parse_header
from idtool.log.rows import Numbers, frame_of, row_count, trial_of_rows, values_of
from idtool.log.table import check_rows
from idtool.log.text import read_text
from idtool.parameters.axis import Axis, check_constant
from idtool.presentation.text import counted

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class Log:
    """One experiment.

    Attributes:
        rows: a frame, columns named as in the file, `trial` always present; or the numbers of a file, of
            which `frame` makes one.
        axis: kind of axis and torque constant.
        experiment: "gravity", "sweep", "sine" or any other word; "" if the log does not say.
        header: every other key of the TOML lines.
        source: where it was read from, for messages.
        incomplete: the file was cut short; its last whole row is the last row here.
        first_line: line of its first row in `source`, counted from 1; 0 where a row is not a line of a file.
        numbered: the first column of the file had no name and held row numbers (pandas' `to_csv` writes
            them); it is left out.
    """

    rows: pd.DataFrame | Numbers
    axis: Axis
    experiment: str = ""
    header: dict[str, Any] = field(default_factory=dict)
    source: str = "log"
    incomplete: bool = False
    first_line: int = 0
    numbered: bool = False

    def __repr__(self) -> str:
        what = f"{self.experiment}, " if self.experiment else ""
        columns = ", ".join(self.columns)
        return (
            f"<Log {self.source}: {what}{self.axis.kind} axis, {counted(self.row_count, 'row')}, "
            f"{counted(len(self.trials), 'trial')}; {columns}>"
        )

    def place(self, row: int) -> str:
        """Where a row, counted from 0, is to be found: "line 12" of a file, "row 3" of a table."""
        return f"line {self.first_line + row}" if self.first_line else f"row {row + 1}"

    @property
    def frame(self) -> pd.DataFrame:
        """The rows as a frame of pandas."""
        return self.rows.frame if isinstance(self.rows, Numbers) else self.rows

    @property
    def _latest(self) -> pd.DataFrame | Numbers:
        return self.rows.latest if isinstance(self.rows, Numbers) else self.rows

    @property
    def trials(self) -> list[pd.DataFrame]:
        """One frame per trial, in the order of the file."""
        return [rows for _, rows in self.frame.groupby("trial", sort=False)]

    @property
    def columns(self) -> list[str]:
        """Names of the columns, in the order of the file."""
        return list(map(str, self._latest.columns))

    def column(self, role: str) -> np.ndarray | None:
        """The values of a role ("velocity", "payload", ...), shape (rows,), or None if absent."""
        name = columns_of(self.axis.kind)[role]
        rows = self._latest
        return values_of(rows, name) if name in rows.columns else None

    def values_of(self, name: str) -> np.ndarray:
        """The values of a column as floats, shape (rows,)."""
        return values_of(self._latest, name)

    @property
    def row_count(self) -> int:
        """How many rows there are."""
        return row_count(self._latest)

    @property
    def trial_of_rows(self) -> NDArray[np.intp]:
        """The trial of every row, counted from 0 as they come, shape (rows,)."""
        return trial_of_rows(self._latest)

    @classmethod
    def read(
        cls, path: str | os.PathLike[str], *, torque_constant: float | None = None, axis: Axis | None = None
    ) -> Log:
        """Read and check a log, gzipped or not.

        Args:
            path: the file. A CSV without TOML lines whose columns carry the log's names is a log too.
            torque_constant: K in N m/A (N/A on a linear axis), for a log that does not say it.
            axis: of which the log is, likewise.

        Raises:
            InputError: no such file, a folder, not a log, or a row that cannot be used; the sentence
                names the row (counted as an editor does, from 1) or the key.
        """
        file = Path(path)
        with in_file(file):
            text = read_text(file)
            header = parse_header(text.comments)
            found, experiment = header_axis(header, text.names)
            if axis is not None:
                found = found.completed(axis)
            if torque_constant is not None and found.torque_constant is None:
                constant = check_constant(torque_constant, argument="torque_constant")
                found = replace(found, torque_constant=constant)
            numbered = False
            rows: pd.DataFrame | Numbers | None = Numbers.of(text, found, file)
            if rows is None:
                rows, numbered = frame_of(text, found)
        rest = {key: value for key, value in header.items() if key not in TOP_KEYS}
        return cls(rows, found, experiment, rest, str(file), text.incomplete, text.line_of_rows, numbered)

    def plot(self, ax: Axes | None = None) -> Figure:
        """Draw a first look, before any fit: position, speed and effort over time, effort over speed.

        Args:
            ax: axes of matplotlib's `subplots` whose place the picture takes; a new figure if None.

        Returns:
            The figure.

        Raises:
            InputError: `ax` has no cell of a grid, or too little room.
        """
        from idtool.log.figure import log_figure
        from idtool.presentation.style import placed

        return placed(lambda: log_figure(self), ax)

    def write(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the log whole or not at all; gzipped if the name ends in `.gz`.

        Raises:
            InputError: `path` exists and `force` is not given, it cannot be written, or the rows are
                none that `read` would take.
        """
        file = Path(path)
        refuse_existing(file, force)
        with in_file(file):
            frame = check_rows(self.frame.copy(), self.axis, None)
        text = header_text(self.axis, self.experiment, self.header)
        if file.suffix == ".gz":
            content = text + frame.to_csv(index=False, lineterminator="\n")
            # no time in it: the same log, the same bytes
            write_whole(file, gzip.compress(content.encode(), mtime=0))
            return
        with atomic_write(file) as stream:
            stream.write(text)
            frame.to_csv(stream, index=False, lineterminator="\n")
