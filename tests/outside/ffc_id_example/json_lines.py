"""Recordings of one JSON object a line."""

import json
from pathlib import Path

import pandas as pd

from idtool.errors import InputError
from idtool.importing.names import Meaning
from idtool.importing.table import Reader, Table

MEANINGS = (
    Meaning("t_us", "time", "us"),
    Meaning("angle", "position", "deg"),
    Meaning("ma", "current", "mA"),
)


def read(raw: bytes, file: Path) -> Table:
    try:
        rows = [json.loads(line) for line in raw.splitlines() if line.strip()]
    except ValueError as error:
        raise InputError("is not one JSON object a line", remedy="export it as CSV") from error
    frame = pd.DataFrame(rows)
    return Table(frame, meanings={m.source: m for m in MEANINGS if m.source in frame})


JSON_LINES = Reader("JSON lines", lambda raw, file: file.suffix == ".jsonl", read)
