"""Recordings of the simulated rig `sim:paper`, and its true parameters."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from idtool import Log
from idtool.experiment.recipe import read_recipe
from idtool.experiment.runner import run
from idtool.fit.results import static_parameters
from idtool.fit.staged import fit_static
from idtool.parameters import Parameters
from idtool.rig.opening import open_rig, read_plant
from idtool.signals import record
from testbench.guided_axes.cases import file_of

SEED = 3


@cache
def log_of(experiment: str, seed: int = SEED, trials: tuple[int, ...] = ()) -> Log:
    """The log that `ffc-id run-EXPERIMENT --rig sim:paper --seed SEED` writes; all of its trials, or some."""
    recipe = read_recipe(experiment)
    if trials:
        recipe = replace(recipe, trials=tuple(recipe.trials[t] for t in trials))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{experiment}.csv"
        run(recipe, open_rig("sim:paper", seed=seed), file)
        return replace(Log.read(file), source=file.name)


@cache
def known_static(seed: int = SEED, trials: tuple[int, ...] = ()) -> Parameters:
    """What a static fit of the velocity sweep says, as `fit-dynamic` wants it."""
    log = log_of("sweep", seed, trials)
    parameters = Parameters(axis=log.axis)
    return replace(parameters, static=static_parameters(fit_static(record([log]), parameters).fit))


def repeated(log: Log, rows: int) -> Log:
    """A log of so many rows: the same trials over and over, numbered on."""
    times = -(-rows // len(log.frame))
    frame = pd.concat([log.frame] * times, ignore_index=True)
    trial = log.frame["trial"].to_numpy()
    frame["trial"] = np.repeat(np.arange(times) * (int(trial.max()) + 1), len(log.frame)) + np.tile(
        trial, times
    )
    return replace(log, rows=frame.iloc[:rows].reset_index(drop=True))


@cache
def truth() -> dict[str, float]:
    """The friction parameters and the inertia that `sim:paper` has."""
    plant = read_plant("paper")
    file = file_of(plant, effects=False)
    friction = {name: one.value for name, one in (file.static | file.dynamic).items()}
    return {"inertia": plant.inertia, **friction}


def off_by(values: Mapping[str, float], name: str) -> float:
    """Per cent by which a parameter misses the truth."""
    return 100.0 * (values[name] / truth()[name] - 1.0)
