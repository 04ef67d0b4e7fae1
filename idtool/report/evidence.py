"""The folder that `identify` leaves behind, read back: all that a report is drawn from.

    evidence = read_evidence(Path("result"))
    evidence.rows.before - evidence.rows.torque     # N m (N)

`params.toml`, `diagnosis.json`, `evidence.json` (see `facts`) and `evidence.csv.gz`, which has one
row per filtered and decimated sample.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.io.plain import plain
from idtool.log.table import as_numbers
from idtool.model.motion import Array
from idtool.model.units import Units
from idtool.parameters import Parameters
from idtool.report.facts import REMEDY, Diagnosis, Facts, read_facts
from idtool.report.result_folder import evidence_document, evidence_rows
from idtool.verbs.identification import Identification

_NEEDED = ("trial", "time_s", "velocity", "torque", "before", "after")
#: Columns that `Rows` calls otherwise.
_FIELDS = {"time_s": "time", "payload_kg": "payload", "temperature_degc": "temperature"}
_MAY_LACK = ("position", "acceleration", "load", "payload_kg", "temperature_degc")


@dataclass(frozen=True)
class Segment:
    """One trial: a run of rows.

    Attributes:
        trial: its number in the file.
        experiment: "gravity", "sweep", "sine", ...; may be empty.
        rows: where it is.
        held_out: neither the parameters nor the choice of effects saw any of its rows.
    """

    trial: int
    experiment: str
    rows: slice
    held_out: bool


@dataclass(frozen=True)
class Rows:
    """The columns of `evidence.csv.gz`, SI, shape (rows,) each; None where nothing was logged.

    "Torque" stands for force on a linear axis: `torque` is what was measured, `before` what the base
    model and `after` what the extended model predict.
    """

    trial: NDArray[np.int64]
    experiment: NDArray[np.object_]
    time: Array
    velocity: Array
    torque: Array
    before: Array
    after: Array
    held_out: NDArray[np.bool_]
    position: Array | None = None
    acceleration: Array | None = None
    load: Array | None = None
    payload: Array | None = None
    temperature: Array | None = None

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def residual_before(self) -> Array:
        """Measured minus the base model's torque."""
        return self.torque - self.before

    @cached_property
    def residual_after(self) -> Array:
        """Measured minus the extended model's torque."""
        return self.torque - self.after

    @cached_property
    def extended(self) -> bool:
        """Whether the extended model is another than the base model."""
        return not np.array_equal(self.before, self.after)

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        """The trials, in the order of the file."""
        return tuple(self._runs(self._trial_changes()))

    @cached_property
    def held_out_spans(self) -> tuple[Segment, ...]:
        """What was held out: whole trials, or blocks of time inside trials."""
        change = self._trial_changes() | (self.held_out[1:] != self.held_out[:-1])
        return tuple(run for run in self._runs(change) if run.held_out)

    def _trial_changes(self) -> NDArray[np.bool_]:
        other_trial = self.trial[1:] != self.trial[:-1]
        other_log = np.asarray(self.experiment[1:] != self.experiment[:-1], dtype=bool)
        return np.asarray(other_trial | other_log, dtype=bool)

    def _runs(self, change: NDArray[np.bool_]) -> Iterator[Segment]:
        edges = [0, *(np.flatnonzero(change) + 1).tolist(), len(self)]
        for start, stop in pairwise(edges):
            rows = slice(start, stop)
            held_out = bool(np.all(self.held_out[rows]))
            yield Segment(int(self.trial[start]), str(self.experiment[start]), rows, held_out)

    @cached_property
    def clock(self) -> Array:
        """Time that rises over all rows: the session's own, or the trials one after another."""
        if np.all(np.diff(self.time) > 0):
            return np.asarray(self.time - self.time[0])
        clock = np.empty(len(self))
        end = 0.0
        for segment in self.segments:
            own = self.time[segment.rows] - self.time[segment.rows.start]
            clock[segment.rows] = end + own
            end += float(own[-1]) + 1.0
        return clock


@dataclass(frozen=True)
class Evidence:
    """Everything a report is drawn from."""

    folder: Path
    parameters: Parameters
    diagnosis: Diagnosis
    facts: Facts
    rows: Rows

    @property
    def kind(self) -> Units:
        """The kind of axis and what its effort is counted in, as the parameter file says."""
        return self.parameters.axis.units


def read_evidence(folder: Path) -> Evidence:
    """Read and check a result folder.

    Raises:
        InputError: the folder or one of its four files is missing or broken, or they disagree.
    """
    if not folder.is_dir():
        if folder.exists():
            problem, remedy = "is a file, no result folder", "name the folder that identify wrote"
        else:
            problem, remedy = "no such folder", f"run ffc-id identify LOG... -o {folder}"
        raise InputError(problem, file=folder, remedy=remedy)
    file = folder / "params.toml"
    if not file.exists():
        raise InputError("no such file", file=file, remedy=f"{REMEDY} with -o {folder}")
    parameters = Parameters.read(file)
    diagnosis = read_facts(folder / "diagnosis.json", Diagnosis)
    facts = read_facts(folder / "evidence.json", Facts)
    if facts.kind != parameters.axis.kind:
        raise InputError(
            f"says the axis is {facts.kind}, but params.toml says {parameters.axis.kind}",
            file=folder / "evidence.json",
            place="kind",
            remedy=REMEDY,
        )
    return Evidence(folder, parameters, diagnosis, facts, read_rows(folder / "evidence.csv.gz"))


def evidence_of(result: Identification) -> Evidence:
    """The evidence of a result that was not written, as `read_evidence` would read it."""
    diagnosis = msgspec.convert(plain(result.diagnosis), Diagnosis)
    facts = msgspec.convert(plain(evidence_document(result, "", 0)), Facts)
    return Evidence(Path(), result.parameters, diagnosis, facts, rows_of(evidence_rows(result), Path()))


def read_rows(file: Path) -> Rows:
    """Read and check `evidence.csv.gz`.

    Raises:
        InputError: missing, not a gzipped CSV, a column missing, or a number that is none.
    """
    try:
        frame = pd.read_csv(file, compression="gzip", keep_default_na=True, dtype={"experiment": "string"})
    except FileNotFoundError as error:
        raise InputError("no such file", file=file, remedy=f"{REMEDY} with -o {file.parent}") from error
    except (OSError, EOFError, ValueError, zlib.error) as error:
        raise InputError(f"is not a whole gzipped CSV ({error})", file=file, remedy=REMEDY) from error
    return rows_of(frame, file)


def rows_of(frame: pd.DataFrame, file: Path) -> Rows:
    """The columns of the table, checked.

    Raises:
        InputError: a column is missing, or a number is none.
    """
    for name in _NEEDED:
        if name not in frame.columns:
            raise InputError("the column is missing", file=file, place=name, remedy=REMEDY)
    if len(frame) < 2:
        raise InputError("holds fewer than two rows", file=file, remedy=REMEDY)
    columns: dict[str, Any] = {_FIELDS.get(name, name): _numbers(frame, name, file) for name in _NEEDED}
    columns |= {_FIELDS.get(name, name): _spare(frame, name, file) for name in _MAY_LACK}
    columns["trial"] = columns["trial"].astype(np.int64)
    columns["experiment"], columns["held_out"] = np.full(len(frame), "", object), np.zeros(len(frame), bool)
    if "experiment" in frame.columns:
        columns["experiment"] = frame["experiment"].fillna("").to_numpy(dtype=object)
    if "held_out" in frame.columns:
        columns["held_out"] = _numbers(frame, "held_out", file) > 0.5
    return Rows(**columns)


def _numbers(frame: pd.DataFrame, name: str, file: Path, *, gaps: bool = False) -> Array:
    values = np.asarray(as_numbers(frame[name]))
    wrong = frame[name].notna().to_numpy() & ~np.isfinite(values) if gaps else ~np.isfinite(values)
    if np.any(wrong):
        row = int(np.argmax(wrong))
        found = frame[name].iloc[row]
        raise InputError(
            f"expected a finite number, found {str(found)[:40]!r}",
            file=file,
            place=f"row {row + 2}, {name}",
            remedy=REMEDY,
        )
    return values


def _spare(frame: pd.DataFrame, name: str, file: Path) -> Array | None:
    if name not in frame.columns:
        return None
    values = _numbers(frame, name, file, gaps=True)
    return values if np.count_nonzero(np.isfinite(values)) >= 2 else None
