"""What a fleet's sessions say together: one row per session, one line per parameter."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from idtool.diagnosis.holm import holm
from idtool.fleet import statistics
from idtool.fleet.work import SessionRow
from idtool.parameters import Parameter, Parameters

SCHEMA = "ffc-id/fleet/1"
#: Level of the tests.
_FOUND = 0.05


@dataclass(frozen=True)
class ParameterLine:
    """A parameter over the fleet; values that no data determine, or at a bound, do not count.

    Attributes:
        key: as in the parameter file; that of an effect after its name ("inertia.inertia_kg_m2").
        units, sessions: that count.
        median: over the units (a unit counts with the median of its sessions).
        spread: between the units, as a standard deviation; None below two units.
        repeatability: between the sessions of one unit, likewise.
        lowest, highest: of the units.
        outlying_units: units that stand out from the others.
        outlying_sessions: sessions that stand out from the others of their unit.
        drift: change per year; None without two dates of one unit.
        drift_p: its p-value, corrected for the number of parameters.
        drifts: whether that is below 0.05.
    """

    key: str
    units: int
    sessions: int
    median: float
    spread: float | None
    repeatability: float | None
    lowest: float
    highest: float
    outlying_units: tuple[str, ...] = ()
    outlying_sessions: tuple[str, ...] = ()
    drift: float | None = None
    drift_p: float | None = None
    drifts: bool = False


@dataclass(frozen=True)
class Fleet:
    """A fleet.

    Attributes:
        sessions: by name of their folders.
        parameters: those that any session determined.
        values: session -> parameter key -> its value, for sessions that did not fail.
    """

    sessions: tuple[SessionRow, ...]
    parameters: tuple[ParameterLine, ...] = ()
    values: Mapping[str, Mapping[str, Parameter]] = field(default_factory=dict)

    @property
    def failed(self) -> tuple[SessionRow, ...]:
        """The sessions that failed."""
        return tuple(row for row in self.sessions if row.error)

    def points(self, key: str) -> pd.DataFrame:
        """Every session that determines a parameter: session, unit, day (None if unknown), value, stderr."""
        rows = []
        for row in self.sessions:
            one = self.values.get(row.session, {}).get(key)
            if one and one.known:
                day = datetime.date.fromisoformat(row.date).toordinal() if row.date else None
                stderr = one.stderr if one.stderr is not None else float("nan")
                rows.append((row.session, row.unit, day, one.value, stderr))
        return pd.DataFrame(rows, columns=["session", "unit", "day", "value", "stderr"])


def summarise(rows: list[SessionRow], folder: Path) -> Fleet:
    """The fleet of these sessions, whose parameter files lie in `folder`/NAME/params.toml."""
    values = {
        row.session: flat(Parameters.read(folder / row.session / "params.toml"))
        for row in rows
        if not row.error
    }
    fleet = Fleet(tuple(rows), values=values)
    keys = dict.fromkeys(key for found in values.values() for key, one in found.items() if one.known)
    points = {key: fleet.points(key) for key in keys}
    drifts = {key: found for key, table in points.items() if (found := _drift(table))}
    corrected = holm({key: found.p_value for key, found in drifts.items()})
    lines = [_line(key, points[key], drifts.get(key), corrected.get(key)) for key in keys]
    return Fleet(tuple(rows), tuple(lines), values)


def flat(parameters: Parameters) -> dict[str, Parameter]:
    """Every parameter of a file by its key; those of effects after their effect's name."""
    document = parameters.to_document()
    tables: list[tuple[str, Mapping[str, Any]]] = [
        ("", document.get("gravity", {})),
        *(("", part) for part in document.get("friction", {}).values()),
        *((f"{effect['name']}.", effect["parameters"]) for effect in document.get("effects", [])),
    ]
    return {
        f"{prefix}{key}": Parameter(one["value"], one.get("stderr"), None, one["at_bound"], one["identified"])
        for prefix, table in tables
        for key, one in table.items()
        if isinstance(one, Mapping)
    }


def _line(
    key: str, points: pd.DataFrame, drift: statistics.Drift | None, p_value: float | None
) -> ParameterLine:
    grouped = points.groupby("unit", sort=True)
    units = grouped["value"].median()
    stderr = grouped["stderr"].median()
    far = statistics.outliers(units.to_numpy(), stderr.to_numpy())
    several = [rows for _, rows in grouped if len(rows) > 1]
    many = [rows for rows in several if len(rows) > 2]
    odd = [
        str(name)
        for rows, mask in zip(
            many, statistics.odd_sessions([rows["value"].to_numpy() for rows in many]), strict=True
        )
        for name in rows["session"][mask]
    ]
    return ParameterLine(
        key,
        len(units),
        len(points),
        float(np.median(units)),
        _finite(statistics.spread(units.to_numpy())),
        _finite(statistics.repeatability([rows["value"].to_numpy() for rows in several])),
        float(units.min()),
        float(units.max()),
        tuple(str(name) for name in units.index[far]),
        tuple(odd),
        drift.per_year if drift else None,
        p_value,
        bool(p_value is not None and p_value < _FOUND),
    )


def _drift(points: pd.DataFrame) -> statistics.Drift | None:
    dated = points.dropna(subset="day")
    return statistics.drift(
        [
            (rows["day"].to_numpy(dtype=float), rows["value"].to_numpy())
            for _, rows in dated.groupby("unit")
            if len(rows) > 1
        ]
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def table(fleet: Fleet) -> pd.DataFrame:
    """One row per session: what became of it, then every parameter with its standard error.

    A value that the data did not determine is left out.
    """
    rows = []
    for row in fleet.sessions:
        record: dict[str, Any] = asdict(row)
        found = fleet.values.get(row.session, {})
        for line in fleet.parameters:
            one = found.get(line.key)
            known = one if one and one.known else None
            record[line.key] = known.value if known else None
            record[f"{line.key}.stderr"] = known.stderr if known else None
        rows.append(record)
    return pd.DataFrame(rows)


def document(fleet: Fleet) -> dict[str, Any]:
    """summary.json."""
    return {
        "schema": SCHEMA,
        "sessions": [
            asdict(row)
            | {
                "parameters": {
                    key: {
                        "value": one.value,
                        "stderr": one.stderr,
                        "at_bound": one.at_bound,
                        "identified": one.identified,
                    }
                    for key, one in fleet.values.get(row.session, {}).items()
                }
            }
            for row in fleet.sessions
        ],
        "failed": [row.session for row in fleet.failed],
        "parameters": [asdict(line) for line in fleet.parameters],
    }
