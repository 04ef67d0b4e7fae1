"""What a command line says of the axis: `--torque-constant` and `--axis`, for logs that do not say it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .common import PATH, Output, handed
from .numbers import Number

if TYPE_CHECKING:
    from idtool.log import Log
    from idtool.parameters.axis import Axis


@dataclass(frozen=True)
class Given:
    """The two options.

    Attributes:
        constant: `--torque-constant`.
        axis_file: `--axis`.
    """

    constant: float | None = None
    axis_file: Path | None = None

    def read(self, logs: Sequence[Path], output: Output, known: Axis | None = None) -> list[Log]:
        """Read logs, telling of those that were cut short, number their rows or hold what is not read.

        Args:
            logs: the files.
            output: where words go.
            known: the axis of a parameter file; its torque constant is the last resort.

        Raises:
            UsageError: both options give a torque constant.
            InputError: a file that cannot be read, or is of another axis than the axis file.
        """
        from idtool.log import Log

        axis = self.axis()
        last = known.torque_constant if known is not None else None
        constant = self.constant or (None if axis is not None and axis.torque_constant else last)
        read = [Log.read(path, torque_constant=constant, axis=axis) for path in logs]
        for log in read:
            if log.incomplete:
                output.warn(f"{log.source} was cut short; it is used up to its last whole row.")
            for name, column in _passed_by(log).items():
                output.warn(f"{log.source}: column {name} is not read; ffc-id import makes it {column}.")
        if numbered := [log.source for log in read if log.numbered]:
            whose = ", ".join(numbered)
            output.warn(f"the first column of {whose} has no name and numbers the rows; it is left out.")
        return read

    def axis(self) -> Axis | None:
        """The axis of the file; None without one.

        Raises:
            UsageError: both options give a torque constant.
            InputError: a file that cannot be read.
        """
        from idtool.errors import UsageError
        from idtool.parameters.axis_file import AxisFile

        axis = AxisFile.read(self.axis_file).axis if self.axis_file is not None else None
        if self.constant is not None and axis is not None and axis.torque_constant is not None:
            raise UsageError("--axis says the torque constant already; leave --torque-constant away.")
        return axis


def _passed_by(log: Log) -> dict[str, str]:
    from idtool.log import columns_of

    known = set(columns_of(log.axis.kind).values())
    if known.issuperset(log.columns):
        return {}  # as mostly, and the words of an import take time to load
    from idtool.importing.names import passed_by

    return passed_by(log.columns, log.axis.kind)


#: `--torque-constant` and `--axis`, handed to the command as `given: Given`.
axis_options = handed(
    "given",
    Given,
    click.option(
        "--torque-constant",
        "constant",
        type=Number(),
        metavar="K",
        help="N m/A (N/A on a linear axis), for logs that do not say it.",
    ),
    click.option(
        "--axis",
        "axis_file",
        type=PATH,
        metavar="FILE",
        help="Axis file (ffc-id init), for logs that do not say what axis they are of.",
    ),
)
