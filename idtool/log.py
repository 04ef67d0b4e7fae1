"""The one log: a CSV file per experiment, TOML lines on top.

A log is a table with one row per sample. Its columns carry their units in their names; which are
needed and which are known is in `columns_of`. Every other column is kept as it is.

    log = Log.read("sweep.csv")
    log.frame      # pandas, file column names
    log.trials     # list of frames, one per trial

`LogWriter` appends while an experiment runs; what it has flushed survives a kill. `Log.write`
writes a finished log whole or not at all.
"""

from __future__ import annotations

import gzip
import io
import os
import tomllib
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pandas as pd
import tomli_w

from idtool.atomic import atomic_write, refuse_existing
from idtool.axis import Axis, check_constant
from idtool.errors import InputError, nearest
from idtool.units import Kind, torque_name

LOG_VERSION = 1
#: The longest line that a reader takes; a longer one is no log (and would eat the memory).
MAX_LINE = 1 << 20

_TOP_KEYS = ("ffc-id-log", "experiment", "axis")


def columns_of(kind: Kind) -> dict[str, str]:
    """Role -> column name of every column with a meaning, per kind of axis."""
    position, velocity = ("m", "m_s") if kind == "linear" else ("rad", "rad_s")
    torque = "n" if kind == "linear" else "nm"
    return {
        "trial": "trial",
        "time": "time_s",
        "position": f"position_{position}",
        "velocity": f"velocity_{velocity}",
        "current": "current_a",
        "torque": f"{torque_name(kind)}_{torque}",
        "velocity_command": f"velocity_command_{velocity}",
        "position_command": f"position_command_{position}",
        "payload": "payload_kg",
        "tilt_alpha": "tilt_alpha_rad",
        "tilt_beta": "tilt_beta_rad",
        "temperature": "temperature_degc",
        "supply_voltage": "supply_voltage_v",
    }


#: Names people give to a column when they leave the unit out.
_UNITLESS = {
    "time": "time_s",
    "t": "time_s",
    "position": "position_rad",
    "pos": "position_rad",
    "q": "position_rad",
    "velocity": "velocity_rad_s",
    "vel": "velocity_rad_s",
    "speed": "velocity_rad_s",
    "current": "current_a",
    "i": "current_a",
    "torque": "torque_nm",
    "force": "force_n",
    "payload": "payload_kg",
    "temperature": "temperature_degc",
    "tilt": "tilt_alpha_rad",
}


@dataclass(frozen=True)
class Log:
    """One experiment.

    Attributes:
        frame: the rows; columns named as in the file, `trial` always present.
        axis: kind of axis and torque constant.
        experiment: "gravity", "sweep", "sine" or any other word; "" if the log does not say.
        header: every other key of the TOML lines.
        source: where it was read from, for messages.
        incomplete: the file was cut short; its last whole row is the last row here.
    """

    frame: pd.DataFrame
    axis: Axis
    experiment: str = ""
    header: dict[str, Any] = field(default_factory=dict)
    source: str = "log"
    incomplete: bool = False

    @property
    def trials(self) -> list[pd.DataFrame]:
        """One frame per trial, in the order of the file."""
        return [rows for _, rows in self.frame.groupby("trial", sort=False)]

    def column(self, role: str) -> np.ndarray | None:
        """The values of a role ("velocity", "payload", ...), shape (rows,), or None if absent."""
        name = columns_of(self.axis.kind)[role]
        return self.frame[name].to_numpy(dtype=float) if name in self.frame.columns else None

    @classmethod
    def read(cls, path: str | os.PathLike[str], *, torque_constant: float | None = None) -> Log:
        """Read and check a log, gzipped or not.

        Args:
            path: the file. A CSV without TOML lines whose columns carry the log's names is a log too.
            torque_constant: K in N m/A (N/A on a linear axis), for a log that does not say it.

        Raises:
            InputError: no such file, a folder, not a log, or a row that cannot be used; the sentence
                names the row (counted as an editor does, from 1) or the key.
        """
        file = Path(path)
        text, cut = _read_text(file)
        header, body, first_row = _split_header(text, file)
        frame, cut_row = _parse_rows(body, first_row, file, strict_end="ffc-id-log" in header)
        axis, experiment = _check_header(header, list(frame.columns), file)
        if torque_constant is not None and axis.torque_constant is None:
            constant = check_constant(torque_constant, place="--torque-constant")
            axis = Axis(axis.kind, constant, axis.extra)
        frame = _check_rows(frame, axis, first_row, file)
        rest = {key: value for key, value in header.items() if key not in _TOP_KEYS}
        return cls(frame, axis, experiment, rest, str(file), cut or cut_row)

    def write(self, path: str | os.PathLike[str], *, force: bool = False) -> None:
        """Write the log whole or not at all.

        Raises:
            InputError: `path` exists and `force` is not given, or cannot be written.
        """
        refuse_existing(Path(path), force)
        with atomic_write(path) as stream:
            stream.write(header_text(self.axis, self.experiment, self.header))
            self.frame.to_csv(stream, index=False, lineterminator="\n")


class LogWriter:
    """Append rows to a log while an experiment runs.

    Every `append` hands whole rows to the operating system; `sync` (called every `sync_every_s`
    seconds of log time and on close) forces them onto the disk. A process that is killed loses
    nothing it appended; a power cut loses at most the seconds since the last sync.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        columns: Sequence[str],
        axis: Axis,
        experiment: str,
        header: Mapping[str, Any] | None = None,
        *,
        force: bool = False,
        sync_every_s: float = 1.0,
    ) -> None:
        """Create the file and write its header.

        Raises:
            InputError: `path` exists and `force` is not given, or cannot be written.
        """
        self.path = Path(path)
        self.columns = list(columns)
        self._time_column = self.columns.index("time_s")
        self._sync_every_s = sync_every_s
        self._synced_at = -float("inf")
        refuse_existing(self.path, force)
        try:
            self._stream = open(self.path, "w", encoding="utf-8", newline="\n")  # noqa: SIM115
        except OSError as error:
            raise _cannot_write(self.path, error) from error
        try:
            self._stream.write(header_text(axis, experiment, dict(header or {})))
            self._stream.write(",".join(self.columns) + "\n")
            self.sync()
        except OSError as error:
            self._stream.close()
            raise _cannot_write(self.path, error) from error

    def append(self, rows: np.ndarray) -> None:
        """Append rows, shape (rows, columns), in the order of `columns`.

        Raises:
            InputError: the disk is full or the file went away; what was synced stays.
        """
        if len(rows) == 0:
            return
        lines = [",".join([_number(value) for value in row]) for row in rows.tolist()]
        try:
            self._stream.write("\n".join(lines) + "\n")
            self._stream.flush()
            if rows[-1, self._time_column] - self._synced_at >= self._sync_every_s:
                self.sync()
                self._synced_at = float(rows[-1, self._time_column])
        except OSError as error:
            raise _cannot_write(self.path, error) from error

    def sync(self) -> None:
        """Force what was appended onto the disk."""
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def close(self) -> None:
        """Sync and close; safe to call twice."""
        if not self._stream.closed:
            try:
                self.sync()
            finally:
                self._stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def header_text(axis: Axis, experiment: str, extra: Mapping[str, Any]) -> str:
    """The TOML lines on top of a log, each with `# ` in front."""
    document: dict[str, Any] = {"ffc-id-log": LOG_VERSION}
    if experiment:
        document["experiment"] = experiment
    document |= {key: value for key, value in extra.items() if key not in _TOP_KEYS}
    document["axis"] = axis.to_table()
    return "".join(f"# {line}".rstrip() + "\n" for line in tomli_w.dumps(document).splitlines())


def _cannot_write(path: Path, error: OSError) -> InputError:
    return InputError(
        f"cannot be written ({error.strerror or error})", file=path, remedy="free space or pick another place"
    )


def _number(value: float) -> str:
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


def _read_text(file: Path) -> tuple[str, bool]:
    """The text of a file, and whether its gzip stream was cut short."""
    if file.is_dir():
        raise InputError("is a folder where a log should be", file=file, remedy="name the log file in it")
    if not file.exists():
        raise InputError("no such file", file=file, remedy="check the path")
    cut = False
    try:
        raw = file.read_bytes()
        if raw[:2] == b"\x1f\x8b":
            chunks = []
            stream = gzip.GzipFile(fileobj=io.BytesIO(raw))
            try:
                while chunk := stream.read(1 << 16):
                    chunks.append(chunk)
            except (EOFError, zlib.error, gzip.BadGzipFile):
                cut = True
            raw = b"".join(chunks)
        text = raw.decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"cannot be read ({error.strerror})", file=file, remedy="check its permissions") from error
    except UnicodeDecodeError as error:
        raise InputError(
            "is not a text file", file=file, remedy="`ffc-id import` reads Parquet and MATLAB files"
        ) from error
    if not text.strip("\0 \t\r\n"):
        raise InputError("the file is empty", file=file, remedy="record it again")
    return text.replace("\r\n", "\n"), cut


def _split_header(text: str, file: Path) -> tuple[dict[str, Any], str, int]:
    """TOML header, the CSV text below it, and the line number of the CSV's column row."""
    start = 0
    number = 1
    lines = []
    while text.startswith("#", start):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        if end - start > MAX_LINE:
            raise InputError("a line of over 1 MiB is no log", file=file, place=f"line {number}")
        lines.append(text[start + 1 : end].removeprefix(" "))
        start, number = end + 1, number + 1
    try:
        header = tomllib.loads("\n".join(lines))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        if any("ffc-id-log" in line for line in lines):
            raise InputError(
                f"the `# ` lines on top are not TOML ({error})", file=file, remedy="mend or remove them"
            ) from error
        header = {}  # somebody else's comment lines
    return header, text[start:], number


def _check_header(header: dict[str, Any], columns: list[str], file: Path) -> tuple[Axis, str]:
    version = header.get("ffc-id-log", LOG_VERSION)
    if version != LOG_VERSION:
        raise InputError(
            f"log version {version!r} is not known",
            file=file,
            place="ffc-id-log",
            remedy=f"this program reads version {LOG_VERSION}",
        )
    experiment = header.get("experiment", "")
    if not isinstance(experiment, str):
        raise InputError("must be a word in quotes", file=file, place="experiment")
    if "axis" in header:
        return Axis.from_table(header["axis"], file=file), experiment
    linear = columns_of("linear")
    is_linear = any(linear[role] in columns for role in ("position", "velocity", "torque"))
    return Axis("linear" if is_linear else "rotary"), experiment


def _parse_rows(body: str, first_row: int, file: Path, *, strict_end: bool) -> tuple[pd.DataFrame, bool]:
    """The table, and whether a half-written last row was dropped.

    `strict_end` (our own logs): a last line without its newline was cut, even if its fields are all
    there, because its last number may lack digits.
    """
    names_line, _, rows_text = body.partition("\n")
    names = [name.strip().strip('"') for name in names_line.split(",")]
    if len(names_line) > MAX_LINE:
        raise InputError("a line of over 1 MiB is no log", file=file, place=f"line {first_row}")
    if not any(names):
        raise InputError("has no header row", file=file, remedy="the first row must name the columns")
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise InputError(f'column "{sorted(doubled)[0]}" appears twice', file=file, remedy="remove one")
    cut = False
    if rows_text and not rows_text.endswith("\n"):
        whole, _, last = rows_text.rpartition("\n")
        if strict_end or last.count(",") < len(names) - 1:
            rows_text, cut = whole, True
    rows_text = rows_text.rstrip("\n")
    if not rows_text.strip():
        raise InputError("has no data rows", file=file, remedy="record it again")
    try:
        frame = pd.read_csv(
            io.StringIO(rows_text), header=None, names=names, index_col=False, skip_blank_lines=False, low_memory=False
        )
    except (pd.errors.ParserError, ValueError) as error:
        raise InputError(_ragged(rows_text, names, first_row) or f"is not a CSV table ({error})", file=file) from error
    if ragged := _ragged(rows_text, names, first_row):
        raise InputError(ragged, file=file, remedy="mend or delete that row")
    return frame, cut


def _ragged(rows_text: str, names: list[str], first_row: int) -> str | None:
    """A sentence about the first row whose number of fields is wrong, or None."""
    if '"' in rows_text:
        return None  # quoted text may hold commas; pandas has checked those
    commas = len(names) - 1
    if rows_text.count(",") == commas * (rows_text.count("\n") + 1):
        lines: Iterable[str] = ()
        if max(map(len, rows_text.split("\n"))) <= MAX_LINE:
            lines = rows_text.split("\n")
    else:
        lines = rows_text.split("\n")
    for offset, line in enumerate(lines):
        if line.count(",") != commas:
            return f"line {first_row + 1 + offset} has {line.count(',') + 1} fields, expected {len(names)}"
    return None


def _check_rows(frame: pd.DataFrame, axis: Axis, first_row: int, file: Path) -> pd.DataFrame:
    roles = columns_of(axis.kind)
    columns = set(frame.columns)
    _need(columns, [roles["time"]], roles, file)
    _need(columns, [roles["velocity"], roles["position"]], roles, file)
    _need(columns, [roles["current"], roles["torque"]], roles, file)
    for name in roles.values():
        if name in columns and name != "trial":
            frame[name] = _numeric(frame[name], name, first_row, file)
    if "trial" not in columns:
        frame.insert(0, "trial", 0)
    elif pd.api.types.is_numeric_dtype(frame["trial"]):
        _numeric(frame["trial"], "trial", first_row, file)
    _check_order(frame, first_row, file)
    if roles["current"] in columns and roles["torque"] not in columns and axis.torque_constant is None:
        raise InputError(
            "current is given but no torque constant",
            file=file,
            place=f"axis.{axis.constant_key}",
            remedy="add it to the `# [axis]` lines or pass --torque-constant",
        )
    return frame


def _need(columns: set[str], any_of: list[str], roles: Mapping[str, str], file: Path) -> None:
    if columns & set(any_of):
        return
    wanted = " or ".join(f'"{name}"' for name in any_of)
    for column in sorted(columns):
        if _UNITLESS.get(column.lower()) in any_of:
            raise InputError(
                f'column "{column}" has no unit',
                file=file,
                remedy=f'name it "{_UNITLESS[column.lower()]}" if that is its unit, or use `ffc-id import --map`',
            )
    free = sorted(columns - set(roles.values()))
    for name in any_of:
        guess = nearest(name, free) if free else ""
        if guess.startswith("did you"):
            raise InputError(
                f"needs a column {wanted}",
                file=file,
                remedy=f'rename {guess.removeprefix("did you mean ")}, or use `ffc-id import --map`',
            )
    raise InputError(
        f"needs a column {wanted}", file=file, remedy="rename the column, or use `ffc-id import --map`"
    )


def _numeric(values: pd.Series[Any], name: str, first_row: int, file: Path) -> pd.Series[float]:
    numbers = pd.to_numeric(values, errors="coerce").astype(float)
    bad = np.flatnonzero(~np.isfinite(numbers.to_numpy()))
    if len(bad):
        row = int(bad[0])
        text = str(values.iloc[row])[:40]
        shown = "is empty or NaN" if text.lower() in ("nan", "") else f'holds "{text}", not a finite number'
        raise InputError(
            f'column "{name}" {shown}',
            file=file,
            place=f"line {first_row + 1 + row}",
            remedy=f"mend or delete that row ({len(bad)} such)",
        )
    return numbers


def _check_order(frame: pd.DataFrame, first_row: int, file: Path) -> None:
    trial = frame["trial"].to_numpy()
    time = frame["time_s"].to_numpy(dtype=float)
    changed = np.flatnonzero(trial[1:] != trial[:-1]) + 1
    starts = np.concatenate([[0], changed])
    if len(pd.unique(trial[starts])) != len(starts):
        seen: set[Any] = set()
        for row in starts:
            if trial[row] in seen:
                raise InputError(
                    f"trial {trial[row]} starts again",
                    file=file,
                    place=f"line {first_row + 1 + int(row)}",
                    remedy="keep the rows of a trial together",
                )
            seen.add(trial[row])
    back = (time[1:] <= time[:-1]) & (trial[1:] == trial[:-1])
    if back.any():
        row = int(np.flatnonzero(back)[0]) + 1
        verb = "stands still" if time[row] == time[row - 1] else "goes backwards"
        raise InputError(
            f"time {verb} ({time[row - 1]:.10g} s, then {time[row]:.10g} s)",
            file=file,
            place=f"line {first_row + 1 + row}",
            remedy=f"sort or remove such rows ({int(back.sum())} in all); `ffc-id import` can do it",
        )
