"""The hand-guiding table of the report, from `teach.json` in the result folder if there is one.

`teach.json` holds one hand guided with several parameter files on the same axis: a name and the figures of
`idtool.guiding.record.TeachFigures` for each.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from idtool.errors import InputError
from idtool.presentation import text

FILE = "teach.json"
#: Of a row, as text, forces in N at the moving part -> where `teach.json` has it, and its digits.
_COLUMNS = {
    "force": ("force_n", 3),
    "uneven": ("uneven_n", 2),
    "speed": ("speed_mm_s", 3),
    "stop": ("stop_ms", 2),
}


def read_guiding(folder: Path) -> list[dict[str, str]]:
    """The rows, one a parameter file; none where the folder has no such file.

    Raises:
        InputError: the file is there and is broken.
    """
    path = folder / FILE
    if not path.exists():
        return []
    try:
        document = json.loads(path.read_text("utf-8"))
        return [{"name": name} | _row(figures) for name, figures in document.items()]
    except (ValueError, OSError, AttributeError, TypeError, KeyError) as error:
        raise InputError(
            "is no record of hand guiding", file=path, remedy="remove it, or make it again"
        ) from error


def _row(figures: dict[str, Any]) -> dict[str, str]:
    return {
        name: text.number(None if figures[key] is None else float(figures[key]), digits)
        for name, (key, digits) in _COLUMNS.items()
    }
