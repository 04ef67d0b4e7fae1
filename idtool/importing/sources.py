"""Files of other programs as one table each: CSV, Parquet, MATLAB."""

from __future__ import annotations

import csv
import io
import re
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from idtool.errors import InputError
from idtool.log_format import parse_header
from idtool.reading import read_bytes

WHAT = "a recording"
#: Files people try that only look like tables -> what to do.
_FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (b"\x89HDF", "is HDF5 (MATLAB v7.3 saves that too)", "in MATLAB save it with -v7, or export it as CSV"),
    (b"PK\x03\x04", "is a zip archive (Excel and NumPy .npz are too)", "export the table as CSV"),
    (b"\x93NUMPY", "is a NumPy array without column names", "save it as CSV with a header row"),
    (b"#ROSBAG", "is a ROS bag", "export the topic as CSV"),
    (b"\x89MCAP", "is an MCAP recording", "export the topic as CSV"),
    (b"SQLite format 3", "is an SQLite database (a ROS 2 bag is too)", "export the topic as CSV"),
)


def read_table(file: Path) -> tuple[pd.DataFrame, dict[str, Any], list[str]]:
    """The table of a file, the header of a log of ours (else empty), and what a person should know.

    Raises:
        InputError: not readable, no table, or a format that is not read.
    """
    raw, cut = read_bytes(file, what=WHAT)
    for magic, problem, remedy in _FOREIGN:
        if raw.startswith(magic) or raw[512:520].startswith(magic) or (magic[1:] == b"HDF" and _is_v73(raw)):
            raise InputError(problem, file=file, remedy=remedy)
    notes = ["the gzip stream is cut short; read up to its last whole row"] if cut else []
    header: dict[str, Any] = {}
    if raw.startswith(b"PAR1"):
        frame = _parquet(raw, file)
    elif raw.startswith(b"MATLAB") or file.suffix.lower() == ".mat":
        frame = _matlab(raw, file, notes)
    else:
        frame, header = _csv(raw, file, cut, notes)
    frame.columns = pd.Index([str(name).strip() for name in frame.columns])
    doubled = [name for name, count in Counter(frame.columns).items() if count > 1]
    if doubled:
        raise InputError(f'column "{doubled[0]}" appears twice', file=file, remedy="rename or remove one")
    if not len(frame):
        raise InputError("has no data rows", file=file, remedy="record it again")
    return frame, header, notes


def _is_v73(raw: bytes) -> bool:
    return raw.startswith(b"MATLAB 7.3")


def _parquet(raw: bytes, file: Path) -> pd.DataFrame:
    try:
        frame = pd.read_parquet(io.BytesIO(raw), engine="pyarrow")
    except ImportError as error:
        raise InputError(
            "is Parquet, which needs pyarrow", file=file, remedy="pip install 'ffc-id[parquet]'"
        ) from error
    except Exception as error:  # the reader of a foreign format may raise anything on bad bytes
        raise InputError(
            "is a damaged Parquet file", file=file, remedy="copy it again from where it was recorded"
        ) from error
    return frame.reset_index() if frame.index.name else frame


def _matlab(raw: bytes, file: Path, notes: list[str]) -> pd.DataFrame:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            stream: Any = io.BytesIO(raw)  # the stubs of scipy know of paths only
            content = loadmat(stream, squeeze_me=True, struct_as_record=True)
    except Exception as error:  # the reader of a foreign format may raise anything on bad bytes
        raise InputError(
            "is not a MATLAB file that can be read", file=file, remedy="in MATLAB save it with -v7"
        ) from error
    vectors: dict[str, np.ndarray] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            _flatten(name, value, vectors)
    lengths = Counter(len(vector) for vector in vectors.values())
    if not lengths:
        raise InputError(
            "holds no vectors of numbers", file=file, remedy="save time, position and torque as vectors"
        )
    rows = lengths.most_common(1)[0][0]
    left = [name for name, vector in vectors.items() if len(vector) != rows]
    if left:
        notes.append(f"left out, not {rows} rows long: {', '.join(sorted(left)[:8])}")
    return pd.DataFrame({name: vector for name, vector in vectors.items() if len(vector) == rows})


def _flatten(name: str, value: Any, vectors: dict[str, np.ndarray]) -> None:
    """Vectors of numbers, the columns of matrices and the fields of structures, each under a name."""
    array = np.asarray(value)
    if array.dtype.names:
        for field in array.dtype.names:
            item = array[field]
            _flatten(f"{name}.{field}", item.item() if item.ndim == 0 else item, vectors)
    elif array.dtype.kind in "fiub" and array.ndim == 1 and len(array) > 1:
        vectors[name] = array.astype(array.dtype.newbyteorder("="))
    elif array.dtype.kind in "fiub" and array.ndim == 2 and min(array.shape) > 0:
        columns = array if array.shape[0] >= array.shape[1] else array.T
        for index in range(min(columns.shape[1], 64)):
            vectors[f"{name}_{index + 1}"] = columns[:, index].astype(array.dtype.newbyteorder("="))


def _csv(raw: bytes, file: Path, cut: bool, notes: list[str]) -> tuple[pd.DataFrame, dict[str, Any]]:
    text = _decode(raw, file)
    if not text.strip():
        raise InputError("the file is empty", file=file, remedy="record it again")
    lines = text.split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    if cut and len(lines) > 1:
        lines.pop()
    start = next(
        (k for k, line in enumerate(lines) if line.strip() and not line.startswith(("#", "%"))), None
    )
    if start is None:
        raise InputError("has no data rows", file=file, remedy="record it again")
    comments = [line[1:].removeprefix(" ") for line in lines[:start]]
    delimiter = _delimiter(lines[start])
    names = _fields(lines[start], delimiter)
    if all(_number(name) for name in names):  # numpy.savetxt puts the names into a comment line
        above = _fields(comments[-1], delimiter) if comments else []
        if len(above) != len(names) or any(map(_number, above)):
            raise InputError(
                "has no header row",
                file=file,
                place=f"line {start + 1}",
                remedy="name the columns in a first row",
            )
        names, body = above, lines[start:]
    else:
        body = lines[start + 1 :]
    header = parse_header(comments, file)
    width = len(names)
    if body and len(_fields(body[-1], delimiter)) < width:
        body.pop()
        notes.append("dropped a half-written last row")
    names = [name or f"unnamed_{index + 1}" for index, name in enumerate(names)]
    if not body:
        raise InputError("has no data rows", file=file, remedy="record it again")
    return _table(names, body, delimiter, file, len(lines) - len(body)), header


def _decode(raw: bytes, file: Path) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    else:
        encodings = ["utf-8-sig", "latin-1"]  # every byte is a character of the second: control ones tell
    for encoding in encodings:
        try:
            text = raw.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not re.search("[\x00-\x08\x0e-\x1f]", text[:100_000]) and "\0" not in text:
            return text.replace("\r\n", "\n").replace("\r", "\n")
    raise InputError(
        "is neither text, Parquet nor a MATLAB file", file=file, remedy="export the recording as CSV"
    )


def _delimiter(line: str) -> str:
    counts = {mark: line.count(mark) for mark in (";", "\t", ",")}
    best = max(counts, key=lambda mark: counts[mark])
    return best if counts[best] else " "


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    try:
        return [
            field.strip()
            for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
        ]
    except csv.Error:
        return [field.strip() for field in line.split(delimiter)]


def _number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _table(names: list[str], body: list[str], delimiter: str, file: Path, first: int) -> pd.DataFrame:
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
            file=file,
            place=f"line {int(place[1]) + first}" if place else None,
            remedy="mend or delete that row" if place else "export the recording as CSV",
        ) from error
    frame.columns = pd.Index(names)
    return frame
