"""Files of other programs as one table each; what kind a file is, its first bytes tell."""

from __future__ import annotations

import io
from collections import Counter
from pathlib import Path

import pandas as pd

from idtool.errors import InputError, in_file
from idtool.importing import bam, dynamixel, lerobot, matlab, ros, text
from idtool.importing.table import Reader, Table
from idtool.io.entry_points import load, outside
from idtool.io.read_file import read_bytes

WHAT = "a recording"
#: The entry points by which other packages add readers.
GROUP = "ffc_id.readers"
#: Files people try that only look like tables -> what to do.
_FOREIGN: tuple[tuple[bytes, str, str], ...] = (
    (b"PK\x03\x04", "is a zip archive (Excel and NumPy .npz are too)", "export the table as CSV"),
    (b"\x93NUMPY", "is a NumPy array without column names", "save it as CSV with a header row"),
)


def read_table(file: Path) -> Table:
    """The table of a file, or of the folder of a ROS 2 bag or of a LeRobot dataset.

    Raises:
        InputError: not readable, no table, or a format that is not read.
    """
    with in_file(file):
        if lerobot.is_dataset(file):
            table = lerobot.read_folder(file, _parquet)
        else:
            table = ros.read(file) if ros.is_bag(file) else _read_file(file)
        frame = table.frame
        frame.columns = pd.Index([str(name).strip() for name in frame.columns])
        doubled = [name for name, count in Counter(frame.columns).items() if count > 1]
        if doubled:
            raise InputError(f'column "{doubled[0]}" appears twice', remedy="rename or remove one")
        if not len(frame):
            raise InputError("has no data rows", remedy="record it again")
    return table


def _read_file(file: Path) -> Table:
    raw, cut = read_bytes(file, what=WHAT)
    for reader in (load(GROUP, name, Reader) for name in outside(GROUP)):  # asked first: they know best
        if reader.recognises(raw, file):
            return reader.read(raw, file)
    for magic, problem, remedy in _FOREIGN:
        if raw.startswith(magic):
            raise InputError(problem, remedy=remedy)
    notes = ["the gzip stream is cut short; read up to its last whole row"] if cut else []
    if raw.startswith(b"PAR1"):
        frame = _parquet(raw)
        return lerobot.interpret(frame, file) if lerobot.is_frame(frame) else Table(frame, notes=notes)
    if matlab.is_hdf5(raw):
        return Table(matlab.read_hdf5(raw, notes), notes=notes)
    if raw.startswith(b"MATLAB") or file.suffix.lower() == ".mat":
        return Table(matlab.read_matlab(raw, notes), notes=notes)
    if raw.lstrip()[:1] == b"{":
        return bam.read(raw)
    frame, header, units = text.read_csv(raw, cut, notes)
    meanings, presumed = dynamixel.interpret(frame, notes)
    return Table(frame, header, notes, meanings, presumed, units)


def _parquet(raw: bytes) -> pd.DataFrame:
    try:
        frame = pd.read_parquet(io.BytesIO(raw), engine="pyarrow")
    except ImportError as error:
        raise InputError("is Parquet, which needs pyarrow", remedy="pip install 'ffc-id[parquet]'") from error
    except Exception as error:  # the reader of a foreign format may raise anything on bad bytes
        raise InputError(
            "is a damaged Parquet file", remedy="copy it again from where it was recorded"
        ) from error
    return frame.reset_index() if frame.index.name else frame
