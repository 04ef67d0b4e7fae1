"""Running an experiment on the simulated rig, and reading its log."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pandas as pd

from benchmarks.table import Section, seconds
from benchmarks.timing import interleaved
from idtool import Log
from idtool.experiment.recipe import read_recipe
from idtool.experiment.runner import run
from idtool.rig import open_rig


def measure(rounds: int = 5) -> Section:
    """The packaged sweep on the paper's axis; its log beside what pandas needs for the same numbers."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sweep.csv"
        recipe = read_recipe("sweep")
        best = interleaved(
            {
                "run": lambda: run(recipe, open_rig("sim:paper"), path, force=True),
                "read": lambda: Log.read(path),
                "pandas": lambda: pd.read_csv(path, comment="#"),
            },
            rounds,
        )
        frame = Log.read(path).frame
    lasted = float(frame["time_s"].iloc[-1] - frame["time_s"].iloc[0])
    section = Section("Rig and log", ["what", "processor time", "ratio"])
    section.add(
        f"`run-sweep` on `sim:paper`, {lasted:.0f} s of the axis, log written",
        seconds(best["run"]),
        f"{lasted / best['run']:.0f} times faster than the axis",
    )
    section.add(
        f"`Log.read`, {len(frame):,} rows of {frame.shape[1]} columns, checked", seconds(best["read"]), ""
    )
    section.add("`pandas.read_csv`", seconds(best["pandas"]), f"{best['pandas'] / best['read']:.2f} of it")
    return section
