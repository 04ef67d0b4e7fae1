"""An interrupted run: which of its trials are whole, so that it goes on with the next."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from idtool.errors import InputError
from idtool.experiment.recipe import Recipe, RecipeTrial
from idtool.log import Log, columns_of
from idtool.model.motion import Array
from idtool.rig.base import Rig

#: Rows that may be missing at the end of a whole trial, where the computer was late.
_SPARE_ROWS = 3


@dataclass(frozen=True)
class Done:
    """What an earlier run left.

    Attributes:
        trials: how many are whole, from the first.
        rows: rows of these.
        first_s, last_s: time of the first and last of these rows, s.
    """

    trials: int = 0
    rows: int = 0
    first_s: float | None = None
    last_s: float = 0.0


def done_in(path: str | os.PathLike[str], recipe: Recipe, rig: Rig, every: int) -> Done:
    """Which trials of the recipe the log holds already.

    Args:
        path: the log; where there is none, nothing is done.
        recipe, rig: those of the run.
        every: samples of the rig per row.

    Raises:
        InputError: the file is no log, or its trials are not those of the recipe.
    """
    if not Path(path).exists():
        return Done()
    log = Log.read(path)
    done = Done()
    time = log.frame["time_s"].to_numpy(dtype=float)
    for index, (rows, trial) in enumerate(zip(log.trials, recipe.trials, strict=False)):
        if rows["trial"].iloc[0] != index:
            raise InputError(
                f"holds trial {rows['trial'].iloc[0]:g} where trial {index} of the recipe should be",
                file=path,
                remedy="name another file, or pass force=True to overwrite it",
            )
        followed = index + 1 < len(log.trials)  # the next one began only after the end of this one
        if not followed and not _is_whole(rows["time_s"].to_numpy(dtype=float), trial, rig, every):
            break
        _check_setup(log, rows, trial, index)
        count = done.rows + len(rows)
        done = Done(index + 1, count, float(time[0]), float(time[count - 1]))
    return done


def _is_whole(time: Array, trial: RecipeTrial, rig: Rig, every: int) -> bool:
    samples = len(trial.motion.command(rig.period_s))
    wanted = (samples - 1 - every * _SPARE_ROWS) * rig.period_s
    return len(time) > 1 and float(time[-1] - time[0]) >= wanted


def _check_setup(log: Log, rows: pd.DataFrame, trial: RecipeTrial, index: int) -> None:
    roles = columns_of(log.axis.kind)
    for role, value in trial.setup.logged.items():
        logged = rows[roles[role]].to_numpy(dtype=float)
        if not np.allclose(logged, value, atol=1e-6):
            raise InputError(
                f"trial {index} was made with {roles[role]} = {logged[0]:g} and the recipe has {value:g}",
                file=log.source,
                remedy="name another file, or pass force=True to overwrite it",
            )
