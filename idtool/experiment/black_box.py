"""The last second before a fault, in a file beside the log."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd

from idtool.errors import InputError, RigFault
from idtool.log import Log, columns_of
from idtool.parameters.axis import Axis
from idtool.rig.base import Block


def fault_path(log: str | os.PathLike[str]) -> Path:
    """Where the last second goes: `sweep.fault.csv` beside `sweep.csv`."""
    path = Path(log)
    return path.with_name(f"{path.name.removesuffix('.csv')}.fault.csv")


def with_remains(
    fault: RigFault, log: str | os.PathLike[str], axis: Axis, remains: str | None = None
) -> RigFault:
    """The same kind of fault, saying what is left of the run; its last second is written beside the log."""
    path = write_fault(log, axis, fault)
    said = [remains] if remains else []
    if path is not None:
        said.append(f"the last second at full rate is in {path}")
    if not said:
        return fault
    told = type(fault)(f"{str(fault).removesuffix('.')}; {', and '.join(said)}.")
    told.history = fault.history
    return told


def write_fault(log: str | os.PathLike[str], axis: Axis, fault: RigFault) -> Path | None:
    """Write what was measured in the second before a fault, at the rig's own period, as a log.

    An earlier one is overwritten, as it belongs to an earlier run.

    Returns:
        The file; None where nothing was measured, or it could not be written: the fault itself is what
        the user has to hear of.
    """
    block = fault.history
    if not isinstance(block, Block) or not len(block.time_s):
        return None
    path = fault_path(log)
    with suppress(InputError):
        header = {"fault": type(fault).__name__, "message": str(fault)}
        Log(_frame(block, axis), axis, "fault", header, str(path)).write(path, force=True)
        return path
    return None


def _frame(block: Block, axis: Axis) -> pd.DataFrame:
    roles = columns_of(axis.kind)
    columns = {
        "trial": np.zeros(len(block.time_s)),
        "time": block.time_s,
        "position": block.position,
        "velocity": block.velocity,
        "current": block.current,
        "bus_current": block.bus_current,
        "duty": block.duty,
        "temperature": block.temperature,
        "supply_voltage": block.voltage,
    }
    table = {roles[name]: np.round(values, 9) for name, values in columns.items() if values is not None}
    return pd.DataFrame(table | {"command": np.round(block.command, 9)})
