"""Logs as a person gives them: one or several, read already or paths."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike, fspath

from idtool.errors import InputError
from idtool.log import Log

#: One log or path.
One = Log | str | PathLike[str]
#: What `identify` and `predict` take.
Logs = One | Iterable[One]


def read_logs(logs: Logs, *, argument: str = "logs", torque_constant: float | None = None) -> list[Log]:
    """Every log, read where a path was given.

    Args:
        logs: a log, a path, or several.
        argument: what the caller calls them, for messages.
        torque_constant: for logs that do not say it.

    Raises:
        InputError: there is none, one is neither log nor path, or a file cannot be read.
    """
    given = [logs] if isinstance(logs, Log | str | PathLike) else logs
    if not isinstance(given, Iterable) or hasattr(given, "columns"):
        raise _neither(given, argument)
    read = [_read(one, argument, torque_constant) for one in given]
    if not read:
        raise InputError("is empty", argument=argument, remedy="give a log or the path of one")
    return read


def _read(one: One, argument: str, torque_constant: float | None) -> Log:
    if isinstance(one, Log):
        return one
    if isinstance(one, str | PathLike):
        return Log.read(fspath(one), torque_constant=torque_constant)
    raise _neither(one, argument)


def _neither(one: object, argument: str) -> InputError:
    return InputError(
        f"{type(one).__name__} is neither a log nor a path",
        argument=argument,
        remedy="give Log.read(...), a path, or a list of them",
    )
