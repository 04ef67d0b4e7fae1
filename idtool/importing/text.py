"""Tables of text: CSV with any common separator, decimal mark and encoding."""

from __future__ import annotations

import csv
import io
import re
import warnings
from typing import Any

import pandas as pd

from idtool.errors import InputError
from idtool.importing.cleaning import LINE
from idtool.log.format import parse_header
from idtool.log.text import is_number


def read_csv(raw: bytes, cut: bool, notes: list[str]) -> tuple[pd.DataFrame, dict[str, Any], dict[str, str]]:
    """The table, its header if it is a log of ours, and column -> unit if a row under the names tells.

    Args:
        raw: the unpacked bytes.
        cut: the file was cut short; its last line is not whole.
        notes: what was repaired is added here.

    Raises:
        InputError: no text, no header row, no data, or no table.
    """
    text = _decode(raw)
    if not text.strip():
        raise InputError("the file is empty", remedy="record it again")
    lines = text.split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    if cut and len(lines) > 1:
        lines.pop()
    start = next(
        (k for k, line in enumerate(lines) if line.strip() and not line.startswith(("#", "%"))), None
    )
    if start is None:
        raise InputError("has no data rows", remedy="record it again")
    comments = [line[1:].removeprefix(" ") for line in lines[:start]]
    delimiter = _delimiter(lines[start])
    names = _fields(lines[start], delimiter)
    if all(is_number(name) for name in names):  # numpy.savetxt puts the names into a comment line
        above = _fields(comments[-1], delimiter) if comments else []
        if len(above) != len(names) or any(map(is_number, above)):
            raise InputError(
                "has no header row", place=f"line {start + 1}", remedy="name the columns in a first row"
            )
        names, body, above_body = above, lines[start:], start
    else:
        body, above_body = lines[start + 1 :], start + 1
    header = parse_header(comments)
    width = len(names)
    if body and len(_fields(body[-1], delimiter)) < width:
        body.pop()
        notes.append("dropped a half-written last row")
    unnamed = not names[0]  # what pandas' `to_csv` makes of an index
    names = [name or f"unnamed_{index + 1}" for index, name in enumerate(names)]
    units = _row_of_units(names, body, delimiter)
    if units:
        body, above_body = body[1:], above_body + 1
        notes.append("the row under the column names was read as their units")
    if not body:
        raise InputError("has no data rows", remedy="record it again")
    table = _table(names, body, delimiter, above_body)
    if unnamed and table[names[0]].equals(pd.Series(range(len(table)))):
        table = table.drop(columns=names[0])
        notes.append("the first column has no name and numbers the rows; left out")
    numbers = [above_body + k + 1 for k, line in enumerate(body) if line.strip()]
    if len(numbers) == len(table):  # no text of it holds a line break
        table.index = pd.Index(numbers, name=LINE)
    return table, header, units


def _row_of_units(names: list[str], body: list[str], delimiter: str) -> dict[str, str]:
    """Column -> unit, if the first row holds words only and the next one numbers."""
    if len(body) < 2:
        return {}
    first, second = (
        [field.replace(",", ".") if delimiter != "," else field for field in _fields(line, delimiter)]
        for line in body[:2]
    )
    if len(first) != len(names) or any(map(is_number, first)) or not any(map(is_number, second)):
        return {}
    return {
        name: text.strip("[]() ") for name, text in zip(names, first, strict=True) if text.strip("[]() -")
    }


def _decode(raw: bytes) -> str:
    wide = raw.startswith((b"\xff\xfe", b"\xfe\xff"))
    # every byte is a character of the last: control ones tell
    for encoding in ["utf-16"] if wide else ["utf-8-sig", "latin-1"]:
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not re.search("[\x00-\x08\x0e-\x1f]", text[:100_000]) and "\0" not in text:
            return text.replace("\r\n", "\n").replace("\r", "\n")
    raise InputError("is neither text, Parquet nor a MATLAB file", remedy="export the recording as CSV")


def _delimiter(line: str) -> str:
    counts = {mark: line.count(mark) for mark in (";", "\t", ",")}
    best = max(counts, key=lambda mark: counts[mark])
    return best if counts[best] else " "


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    try:
        fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        fields = line.split(delimiter)
    return [field.strip() for field in fields]


def _table(names: list[str], body: list[str], delimiter: str, first: int) -> pd.DataFrame:
    lines = "\n".join(body) + "\n"
    decimal = "," if delimiter in ";\t" and re.search(r"(?:^|[;\t])\s*-?\d+,\d", lines, re.MULTILINE) else "."
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            frame = pd.read_csv(
                io.StringIO(lines),
                header=None,
                names=range(len(names)),
                index_col=False,
                sep=r"\s+" if delimiter == " " else delimiter,
                decimal=decimal,
                skipinitialspace=True,
                skip_blank_lines=True,
                low_memory=False,
            )
    except (pd.errors.ParserError, ValueError, OverflowError) as error:
        place = re.search(r"line (\d+)", str(error))
        raise InputError(
            "a row has too many fields" if place else "is not a table",
            place=f"line {int(place[1]) + first}" if place else None,
            remedy="correct or delete that row" if place else "export the recording as CSV",
        ) from error
    frame.columns = pd.Index(names)
    return frame
