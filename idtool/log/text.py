"""The text of a log file taken apart: its lines on top, its columns, its rows."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from idtool.errors import InputError
from idtool.io.read_file import MAX_LINE, read_bytes


@dataclass(frozen=True)
class LogText:
    """A log file taken apart, its rows not read yet.

    Attributes:
        comments: the leading `#` lines, without `# `.
        names: the columns.
        rows: the data rows, each ended by a newline.
        ends: position of each row's last byte (its newline) in `rows`.
        first_line: line number of the first data row, as an editor counts.
        incomplete: the file was cut short and its last, partial row is left out.
    """

    comments: list[str]
    names: list[str]
    rows: bytes
    ends: np.ndarray
    first_line: int
    incomplete: bool

    @property
    def line_of_rows(self) -> int:
        """The line of the first row, where every row is a line; 0 where quoted text holds line breaks."""
        return self.first_line if self.rows.count(b"\n") == len(self.ends) else 0

    def line(self, row: int) -> int:
        """The line number of a data row; quoted text may hold line breaks of its own."""
        start = int(self.ends[row - 1]) + 1 if row else 0
        return self.first_line + self.rows.count(b"\n", 0, start)


def read_text(file: Path) -> LogText:
    """Take a log file apart.

    Raises:
        InputError: not readable, not text, no header row, no data rows, rows of unequal length.
    """
    raw, cut = read_bytes(file, what="a log", text=True)
    raw = raw.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n")
    if b"\n" not in raw:
        raw = raw.replace(b"\r", b"\n")
    if raw.endswith(b"\0"):  # a power cut leaves zeros where the data never arrived
        raw, cut = raw.rstrip(b"\0"), True
    if b"\0" in raw:
        raise not_text()
    if not raw.strip():
        raise InputError("the file is empty", remedy="record it again")
    if file.suffix == ".toml":
        raise InputError("is a TOML file and no log", remedy="pass the CSV file of a run")
    comments, start = _comments(raw)
    line_end = raw.find(b"\n", start)
    names = _names(raw[start:] if line_end < 0 else raw[start:line_end], len(comments) + 1)
    rows = raw[line_end + 1 :] if line_end >= 0 else b""
    # In a log of ours a last line without its newline was cut, even if all its fields are there: its
    # last number may lack digits. Elsewhere many programs leave that newline out.
    ours = cut or any(line.startswith("ffc-id-log") for line in comments)
    quoted = rows.count(b'"')
    rows, ends, dropped = _whole_rows(rows, len(names), drop_unended=ours)
    if not len(ends) and quoted % 2:
        raise InputError("a quote is not closed", remedy="remove or close the quote")
    if not len(ends):
        raise InputError("has no data rows", remedy="record it again")
    text = LogText(comments, names, rows, ends, len(comments) + 2, cut or dropped)
    _check_lengths(text)
    return text


def not_text() -> InputError:
    """The one sentence about a file that is no text."""
    return InputError(
        "is not a text file in UTF-8",
        remedy="`ffc-id import` reads other encodings, Parquet and MATLAB files",
    )


def _comments(raw: bytes) -> tuple[list[str], int]:
    """The leading `#` lines without `# `, and where the rest starts."""
    start = 0
    lines: list[str] = []
    while raw.startswith(b"#", start):
        end = raw.find(b"\n", start)
        end = len(raw) if end < 0 else end
        if end - start > MAX_LINE:
            raise InputError(
                "a line of over 1 MiB is no log", place=f"line {len(lines) + 1}", remedy="check the path"
            )
        try:
            lines.append(raw[start + 1 : end].decode().removeprefix(" "))
        except UnicodeDecodeError as error:
            raise not_text() from error
        start = end + 1
    return lines, start


def _names(line: bytes, number: int) -> list[str]:
    wrong = partial(InputError, place=f"line {number}")
    if len(line) > MAX_LINE:
        raise wrong("a line of over 1 MiB is no log", remedy="check the path")
    try:
        text = line.decode()
        names = [name.strip() for name in next(csv.reader([text], skipinitialspace=True), [])]
    except UnicodeDecodeError as error:
        raise not_text() from error
    except csv.Error as error:
        raise wrong(f"the header row is not CSV ({error})", remedy="correct that line") from error
    if not any(names):
        raise wrong("has no header row", remedy="the first row must name the columns")
    if all(is_number(name) for name in names):
        raise wrong(
            "the header row is missing, the rows start at once", remedy="name the columns in a row above them"
        )
    if len(names) == 1 and (";" in text or "\t" in text):
        raise wrong("the columns are not separated by commas", remedy="`ffc-id import` reads such files")
    if "" in names[1:]:
        raise nameless(names.index("", 1), number)
    if doubled := sorted(name for name in set(names) if names.count(name) > 1):
        raise wrong(f'column "{doubled[0]}" appears twice', remedy="rename or remove one")
    return names


def nameless(column: int, number: int) -> InputError:
    """The one sentence about a column, counted from 0, without a name."""
    return InputError(
        f"column {column + 1} has no name", place=f"line {number}", remedy="name it or remove it"
    )


def is_number(text: str) -> bool:
    """Whether a cell of a table holds a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def _whole_rows(rows: bytes, width: int, *, drop_unended: bool) -> tuple[bytes, np.ndarray, bool]:
    """Rows without a half-written last one, the position of each row's end, and whether one was dropped."""
    dropped = False
    if rows and not rows.endswith(b"\n"):
        if drop_unended:
            rows, dropped = rows[: rows.rfind(b"\n") + 1], True
        else:
            rows += b"\n"
    rows = rows.rstrip(b"\n") + b"\n" if rows.strip(b"\n") else b""
    ends = _outside_quotes(rows, b"\n")
    if len(ends) and rows.count(b",", int(ends[-2]) + 1 if len(ends) > 1 else 0) < width - 1:
        ends, dropped = ends[:-1], True
        rows = rows[: int(ends[-1]) + 1] if len(ends) else b""
    elif rows and not len(ends):  # a quote that never closes: the cut went through it
        rows, dropped = b"", True
    return rows, ends, dropped


def _outside_quotes(rows: bytes, mark: bytes) -> np.ndarray:
    """Positions of a one-byte mark that is not inside quoted text."""
    data = np.frombuffer(rows, np.uint8)
    found = np.flatnonzero(data == mark[0])
    if b'"' in rows:
        quotes = np.flatnonzero(data == ord('"'))
        found = found[np.searchsorted(quotes, found) % 2 == 0]
    return found


def _check_lengths(text: LogText) -> None:
    fields = np.diff(np.searchsorted(_outside_quotes(text.rows, b","), text.ends), prepend=0) + 1
    wrong = np.flatnonzero(fields != len(text.names))
    if len(wrong):
        row = int(wrong[0])
        start = int(text.ends[row - 1]) + 1 if row else 0
        blank = not text.rows[start : int(text.ends[row])].strip()
        raise InputError(
            "the line is empty" if blank else f"has {fields[row]} fields, expected {len(text.names)}",
            place=f"line {text.line(row)}",
            remedy="correct or delete that line" + (f" ({len(wrong)} such)" if len(wrong) > 1 else ""),
        )
