"""The hand-guiding table of the report, from `teach.json` in the result folder if there is one.

`teach.json` holds one hand guided with several parameter files on the same axis: a name and the figures of
`idtool.guiding.record.TeachFigures` for each.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from idtool.errors import InputError
from idtool.presentation import text

FILE = "teach.json"


@dataclass(frozen=True)
class GuidingRow:
    """One parameter file, as text; forces in N at the moving part."""

    name: str
    force: str
    uneven: str
    speed: str
    stop: str


def read_guiding(folder: Path) -> list[GuidingRow]:
    """The rows; none where the folder has no such file.

    Raises:
        InputError: the file is there and is broken.
    """
    path = folder / FILE
    if not path.exists():
        return []
    try:
        document = json.loads(path.read_text("utf-8"))
        return [_row(str(name), figures) for name, figures in document.items()]
    except (ValueError, OSError, AttributeError, TypeError, KeyError) as error:
        raise InputError(
            "is no record of hand guiding", file=path, remedy="remove it, or make it again"
        ) from error


def _row(name: str, figures: dict[str, Any]) -> GuidingRow:
    def number(key: str, digits: int) -> str:
        value = figures[key]
        return text.number(None if value is None else float(value), digits)

    return GuidingRow(
        name, number("force_n", 3), number("uneven_n", 2), number("speed_mm_s", 3), number("stop_ms", 2)
    )
