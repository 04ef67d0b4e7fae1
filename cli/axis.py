"""What a command line says of the axis: `--torque-constant` and `--axis`, for logs that do not say it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .common import Output
from .numbers import Number

if TYPE_CHECKING:
    from idtool.log import Log
    from idtool.parameters.axis import Axis

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Given:
    """The two options.

    Attributes:
        constant: `--torque-constant`.
        file: `--axis`.
    """

    constant: float | None = None
    file: Path | None = None

    def read(self, logs: Sequence[Path], output: Output, known: Axis | None = None) -> list[Log]:
        """Read logs, telling of those that were cut short or number their rows.

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

        axis = AxisFile.read(self.file).axis if self.file is not None else None
        if self.constant is not None and axis is not None and axis.torque_constant is not None:
            raise UsageError("--axis says the torque constant already; leave --torque-constant away.")
        return axis


def constant_option(command: F) -> F:
    """`--torque-constant`."""
    return click.option(
        "--torque-constant",
        type=Number(),
        metavar="K",
        help="N m/A (N/A on a linear axis), for logs that do not say it.",
    )(command)


def axis_options(command: F) -> F:
    """`--torque-constant` and `--axis`, handed to the command as `given: Given`."""

    def collect(ctx: click.Context, /, **kwargs: Any) -> Any:
        given = Given(kwargs.pop("torque_constant"), kwargs.pop("axis"))
        return ctx.invoke(command, given=given, **kwargs)

    collect.__name__ = command.__name__
    collect.__doc__ = command.__doc__
    collect.__click_params__ = getattr(command, "__click_params__", [])  # type: ignore[attr-defined]
    decorated: Any = click.option(
        "--axis",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Axis file (ffc-id init), for logs that do not say what axis they are of.",
    )(click.pass_context(collect))
    return constant_option(decorated)  # type: ignore[no-any-return]
