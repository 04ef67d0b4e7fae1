"""Logs of an axis that an eccentric mass pulls, for the example of an effect from outside."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from idtool.experiment.recipe import Changes, read_recipe
from idtool.experiment.runner import run
from idtool.log import Log
from idtool.rig import open_rig

#: What it pulls with, N m: of the sine and of the cosine of the angle.
SINE, COSINE = 0.02, -0.01


def pulled(folder: Path) -> list[Log]:
    """Gravity and sweep on `sim:bench`, with the mass; written into `folder` without it."""
    logs = []
    with open_rig("sim:bench", seed=1) as rig:
        for name in ("gravity", "sweep"):
            run(
                read_recipe(name, Changes(payloads=(0.0, 0.5, 1.0, 1.5)) if name == "gravity" else None),
                rig,
                folder / f"{name}.csv",
            )
            log = Log.read(folder / f"{name}.csv")
            q, constant = log.frame["position_rad"], log.axis.torque_constant
            pull = (SINE * np.sin(q) + COSINE * np.cos(q)) / constant
            logs.append(replace(log, rows=log.frame.assign(current_a=log.frame["current_a"] + pull)))
    return logs
