"""A log played back as if it happened now: the same readings, trial by trial.

To try limits, a controller or a fit of one's own on what a real axis once did. Nothing moves, so what is
commanded changes nothing.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

import numpy as np
import pandas as pd

from idtool.errors import InputError, RigFault
from idtool.log import Log, columns_of
from idtool.rig.base import Block, Limits, Rig, Sample, Trajectory, TrialSetup

#: Rows in a block, and how far the limits lie beyond what the log reached (share).
_BLOCK, _ROOM = 50, 0.2
#: Rows that a trial may lack at its end.
_SPARE_ROWS = 5


class ReplayRig(Rig):
    """A log as a rig.

    Args:
        path: the log; it needs position, velocity, and current or duty with the supply's voltage.

    Raises:
        InputError: it is none, or lacks one of them.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        log = Log.read(path)
        self._roles = columns_of(log.axis.kind)
        by_duty = all(self._roles[role] in log.frame for role in ("duty", "supply_voltage"))
        self.measures = "voltage" if by_duty and self._roles["current"] not in log.frame else "current"
        self.measures_bus_current = self._roles["bus_current"] in log.frame
        for role in ("position", "velocity", *self.effort_readings):
            if self._roles[role] not in log.frame:
                raise InputError(
                    f"has no column {self._roles[role]}", file=path, remedy="play back a log that has one"
                )
        self.axis = log.axis
        self.description = f"replay of {log.header.get('rig', 'a log')}"
        self._trials = log.trials
        steps = np.concatenate([np.diff(rows["time_s"]) for rows in self._trials])
        if not len(steps):
            raise InputError("has no trial of two rows", file=path, remedy="play back a longer log")
        self.period_s = round(float(np.median(steps)), 6)
        self.measures_temperature = self._roles["temperature"] in log.frame
        self.measures_voltage = self._roles["supply_voltage"] in log.frame
        self.limits = self._limits(log.frame)
        self._source = str(path)
        self._index = -1
        self._at = 0

    def _limits(self, frame: pd.DataFrame) -> Limits:
        position = frame[self._roles["position"]]
        room = _ROOM * float(np.ptp(position)) + 1e-3

        def most(role: str) -> float:
            commanded = frame.get(self._roles[f"{role}_command"]) if role == "velocity" else None
            values = [frame[self._roles[role]], *([] if commanded is None else [commanded])]
            return (1.0 + _ROOM) * max(float(np.nanmax(np.abs(v))) for v in values) + 1e-6

        current = most("current") if self.measures == "current" else math.inf
        return Limits((float(position.min()) - room, float(position.max()) + room), most("velocity"), current)

    def prepare(self, setup: TrialSetup) -> None:
        """Go to the next trial of the log, which must have been made with this set-up.

        Raises:
            RigFault: there is none, or it was made with another.
        """
        self._open()
        if self._index + 1 >= len(self._trials):
            raise RigFault(f"{self._source} has {len(self._trials)} trials and no further one")
        self._index += 1
        self._at = 0
        self._prepared = True
        first = self._trials[self._index].iloc[0]
        for role, wanted in setup.logged.items():
            name = self._roles[role]
            if name in first and abs(float(first[name]) - wanted) > 1e-6:
                raise RigFault(
                    f"trial {self._index} of {self._source} was made with {name} = {first[name]:g}, "
                    f"not {wanted:g}; play it back with its own recipe"
                )

    def play(self, trajectory: Trajectory) -> Iterator[Block]:
        """The rows of the trial, as long as the trajectory lasts.

        Raises:
            RigFault: the log ends before the trajectory does.
        """
        rows = self._rest()
        wanted = round(len(trajectory.command) * trajectory.period_s / self.period_s)
        time = rows["time_s"].to_numpy(dtype=float)
        lasting = int(np.searchsorted(time, time[0] + (wanted - 0.5) * self.period_s)) if len(time) else 0
        for begin in range(0, lasting, _BLOCK):
            self._open()
            part = rows.iloc[begin : min(begin + _BLOCK, lasting)]
            self._at += len(part)
            yield self._block(part, trajectory)
        if not len(time) or time[lasting - 1] - time[0] < (wanted - 1 - _SPARE_ROWS) * self.period_s:
            raise RigFault(f"trial {self._index} of {self._source} ends before the trajectory does")

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        """The next row, whatever is commanded.

        Raises:
            RigFault: the trial is over.
        """
        if external_torque_nm != 0.0:
            raise RigFault("a simulated hand cannot push a log")
        rows = self._rest()
        if not len(rows):
            raise RigFault(f"trial {self._index} of {self._source} is over")
        self._at += 1
        row = rows.iloc[0]
        readings = {field: float(row[self._roles[role]]) for role, field in self._readings().items()}
        return Sample(float(row["time_s"]), **({"current": None} | readings))  # type: ignore[arg-type]

    def stop(self) -> None:
        """Nothing moves."""

    def close(self) -> None:
        """Afterwards the rig answers with a fault."""
        self._closed = True

    def _rest(self) -> pd.DataFrame:
        self._ready()
        return self._trials[self._index].iloc[self._at :]

    def _block(self, rows: pd.DataFrame, trajectory: Trajectory) -> Block:
        def values(role: str) -> np.ndarray:
            return rows[self._roles[role]].to_numpy(dtype=float)

        begin = self._at - len(rows)
        name = self._roles["velocity_command" if trajectory.mode == "velocity" else "position_command"]
        if name in rows:
            command = rows[name].to_numpy(dtype=float)
        else:
            due = trajectory.held(self.period_s)
            command = due[np.minimum(np.arange(begin, self._at), len(due) - 1)]
        return Block(
            rows["time_s"].to_numpy(dtype=float),
            command=command,
            **({"current": None} | {field: values(role) for role, field in self._readings().items()}),  # type: ignore[arg-type]
        )

    def _readings(self) -> dict[str, str]:
        """Role of a column -> field of a block, for every reading that the log has."""
        readings = {"position": "position", "velocity": "velocity"} | self.effort_readings
        readings |= {"temperature": "temperature"} if self.measures_temperature else {}
        return readings | ({"supply_voltage": "voltage"} if self.measures_voltage else {})
