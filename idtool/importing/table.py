"""What a reader of a foreign format hands on: the table, and what the format itself says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pandas as pd

from idtool.importing.names import Meaning


@dataclass(frozen=True)
class Table:
    """A recording as one table.

    Attributes:
        frame: the rows; columns as the recording names them.
        header: the header of a log of ours, else empty.
        notes: what a person should know, one sentence each without a full stop.
        meanings: columns whose meaning the format fixes, whatever their names look like.
        presumed: column -> unit that such files usually have, to be confirmed with --unit.
        units: column -> unit that the recording states beside its names.
        single: columns that tell one axis from another; a log holds one value of each.
        experiment: what the recording says it is, "" if nothing.
        facts: further facts that the recording states, for the header of the log.
    """

    frame: pd.DataFrame
    header: Mapping[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    meanings: Mapping[str, Meaning] = field(default_factory=dict)
    presumed: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    single: tuple[str, ...] = ()
    experiment: str = ""
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Reader:
    """A format that another package reads (entry points `ffc_id.readers`).

    Attributes:
        title: what the format is called.
        recognises: (raw content, file) -> whether it is such a file; told by its first bytes, or its name.
        read: (raw content, file) -> its table; raises InputError.
    """

    title: str
    recognises: Callable[[bytes, Path], bool]
    read: Callable[[bytes, Path], Table]
