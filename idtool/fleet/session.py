"""Sessions of a folder, and what is known of each before it is identified.

A session is a folder with logs of one axis. Which unit it is and when it was recorded says, in this
order: `session.toml` in the folder (`unit`, `date`), the logs' headers (`unit` in `[axis]`, `date`), the
folder's name ("A3_2026-03-01": unit A3). A folder without a date in its name is a unit of that name.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from idtool.errors import InputError, in_file
from idtool.io.read_file import read_bytes
from idtool.io.tables import no_strangers
from idtool.io.toml import read_document, short
from idtool.log import Log

FACTS = "session.toml"
_DATE = re.compile(r"(?<!\d)(\d{4})-(\d{2})-(\d{2})(?!\d)")
_WHAT = "a log"
_EXAMPLE = 'write unit = "A3" and date = 2026-03-01'


@dataclass(frozen=True)
class Task:
    """A session as it travels to whoever identifies it; no folder need be shared.

    Attributes:
        name: of the session.
        logs: file name -> its bytes.
        facts: content of `session.toml`, b"" without one.
        options: keyword arguments of `identify`, and `torque_constant`.
    """

    name: str
    logs: Mapping[str, bytes]
    facts: bytes
    options: Mapping[str, Any]

    def fingerprint(self, version: str) -> str:
        """Of all that the result depends on: a session that has not changed need not be done again."""
        whole = hashlib.sha256(
            json.dumps([version, dict(self.options)], sort_keys=True, default=str).encode()
        )
        for name, content in (*sorted(self.logs.items()), (FACTS, self.facts)):
            whole.update(f"{name}:{len(content)}:".encode())
            whole.update(content)
        return whole.hexdigest()


def find_sessions(folder: Path) -> list[Path]:
    """The folders in `folder` that hold logs, by name.

    Raises:
        InputError: no such folder, or none with logs in it.
    """
    if not folder.is_dir():
        problem = "is a file where a folder of sessions should be" if folder.exists() else "no such folder"
        raise InputError(problem, file=folder, remedy="name the folder that holds the session folders")
    found = sorted(path for path in folder.iterdir() if path.is_dir() and logs_of(path))
    if not found:
        there = "logs, but no folders with logs" if logs_of(folder) else "no folder with logs (*.csv)"
        raise InputError(
            f"holds {there}", file=folder, remedy="put the logs of each session into a folder of its own"
        )
    return found


def logs_of(folder: Path) -> list[Path]:
    """The files of a session that should be logs, by name."""
    return sorted(
        path
        for path in folder.iterdir()
        if path.name.endswith((".csv", ".csv.gz")) and not path.name.startswith(".") and path.is_file()
    )


def load(folder: Path, options: Mapping[str, Any]) -> Task:
    """Read a session whole.

    Raises:
        InputError: a file that cannot be read.
    """
    facts = folder / FACTS
    return Task(
        folder.name,
        {path.name: read_bytes(path, what=_WHAT)[0] for path in logs_of(folder)},
        facts.read_bytes() if facts.is_file() else b"",
        options,
    )


def identity(task: Task, logs: Sequence[Log]) -> tuple[str, datetime.date | None]:
    """Unit and date of a session.

    Raises:
        InputError: `session.toml` cannot be used, or logs of different units.
    """
    told = _facts(task)
    unit = told.get("unit") or _only([log.axis.extra.get("unit") for log in logs], "unit", task.name)
    date = _date(told.get("date")) or _date(next((d for log in logs if (d := log.header.get("date"))), None))
    in_name = _DATE.search(task.name)
    if in_name and date is None:
        date = _date(in_name[0])
    if unit is None:
        rest = _DATE.sub("", task.name) if in_name else task.name
        unit = rest.strip(" _-.") or task.name
    return str(unit), date


def _facts(task: Task) -> dict[str, Any]:
    file = Path(task.name) / FACTS
    told = read_document(task.facts, file, what="facts of a session")
    with in_file(file):
        no_strangers(told, ("unit", "date"), "")
        for key, value in told.items():
            if not (isinstance(value, str) if key == "unit" else _date(value) is not None):
                raise InputError(f"{short(value)} is no {key}", place=key, remedy=_EXAMPLE)
    return told


def _date(value: Any) -> datetime.date | None:
    """A date as TOML or a text has it, or None."""
    if isinstance(value, datetime.datetime):
        return value.date()
    if isinstance(value, datetime.date):
        return value
    try:
        return datetime.date.fromisoformat(str(value)[:10])
    except ValueError:
        return None


def _only(values: Sequence[Any], what: str, name: str) -> Any:
    there = sorted({str(value) for value in values if value is not None})
    if len(there) > 1:
        raise InputError(
            f"its logs are of different {what}s ({', '.join(there[:4])})",
            file=name,
            remedy="put each into a folder of its own",
        )
    return there[0] if there else None
