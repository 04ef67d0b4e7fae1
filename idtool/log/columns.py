"""What a fit reads of a log, row by row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.errors import InputError
from idtool.log import Log, columns_of
from idtool.log.effort import Effort
from idtool.model.motion import Array

#: SI magnitudes of a column as a whole lie between this and its inverse for every axis there is; squares and
#: products of what does not lie there leave the range of a float. Times in seconds since 1970 are 2e9.
_LARGEST = 1e12
#: What a log says of these where it has no such column and another log of the same axis has one.
_NEUTRAL = {"payload": 0.0, "tilt_alpha": 0.0, "tilt_beta": 0.0}


@dataclass
class Columns:
    """Shape (rows,) each; None where there is no such column.

    Attributes:
        time: s.
        trial: of each row, counted from 0.
        effort, back_emf: what stands for the motor's torque (`Effort`).
        position, velocity: rad (m), rad/s (m/s).
        payload: kg.
        tilt_alpha, tilt_beta: rad.
        temperature: degrees Celsius.
    """

    time: Array
    trial: NDArray[np.intp]
    effort: Array
    back_emf: Array
    position: Array | None
    velocity: Array | None
    payload: Array | None
    tilt_alpha: Array | None
    tilt_beta: Array | None
    temperature: Array | None

    def __len__(self) -> int:
        return len(self.time)

    @property
    def first(self) -> NDArray[np.bool_]:
        """True at the first row of each trial."""
        return np.asarray(np.diff(self.trial, prepend=-1) != 0)

    @classmethod
    def of(cls, log: Log, effort: Effort) -> Columns:
        """Those of one log.

        Raises:
            InputError: one of them is of no axis.
        """
        names = columns_of(log.axis.kind)
        read = {role: log.column(role) for role in names if role != "trial"}
        for role, values in read.items():
            if values is not None:
                _refuse_magnitude(values, names[role], log.source)
        own = {"trial": log.trial_of_rows, "effort": effort.values, "back_emf": effort.back_emf}
        return cls(**{field.name: (read | own)[field.name] for field in fields(cls)})  # type: ignore[arg-type]

    def picked(self, rows: NDArray[np.bool_]) -> Columns:
        """Some of the rows; their trials are counted anew."""
        kept: dict[str, Any] = {
            f.name: None if (v := getattr(self, f.name)) is None else v[rows] for f in fields(self)
        }
        return Columns(**kept | {"trial": np.unique(self.trial[rows], return_inverse=True)[1]})

    @classmethod
    def joined(cls, parts: Sequence[Columns]) -> Columns:
        """Several logs, one after another. A column that only some have takes its neutral value in the rest,
        and is left out where it has none."""
        joined: dict[str, Any] = {}
        for name in (field.name for field in fields(cls)):
            values = [getattr(part, name) for part in parts]
            there = [one is not None for one in values]
            if any(there) and name in _NEUTRAL:
                neutral = _NEUTRAL[name]
                values = [
                    np.full(len(part), neutral) if one is None else one
                    for part, one in zip(parts, values, strict=True)
                ]
            joined[name] = np.concatenate(values) if all(one is not None for one in values) else None
        offsets = np.cumsum([0, *(part.trial.max() + 1 for part in parts[:-1])])
        trial = np.concatenate([part.trial + offset for part, offset in zip(parts, offsets, strict=True)])
        return cls(**joined | {"trial": trial})


def _refuse_magnitude(values: Array, name: str, file: str) -> None:
    """Refuse a column that is of no axis as a whole; single readings that cannot be are left out later."""
    size = np.abs(values)
    if (typical := float(np.quantile(size, 0.5, method="lower"))) > _LARGEST:
        problem = f'column "{name}" is about {typical:.0e}, which no axis reaches'
    elif 0.0 < float(size.max()) < 1.0 / _LARGEST:
        problem = f'column "{name}" stays below {1.0 / _LARGEST:.0e}, which no sensor sees'
    else:
        return
    raise InputError(problem, file=file, remedy="check its unit")
