"""What short commands cost as a user starts them: imports, reading, computing, writing."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

from benchmarks.table import Section, seconds
from benchmarks.timing import shortest

_GOAL = 1.0
_PROGRAM = str(Path(sys.executable).with_name("ffc-id"))
_IMPORTS = "import numpy, numba"
_SESSION = Path(__file__).resolve().parent.parent / "data" / "session"
_GRAVITY, _SWEEP, _SINE = (str(_SESSION / f"{name}.csv.gz") for name in ("gravity", "sweep", "sine"))
TASKS = {
    f'python -c "{_IMPORTS}"': [sys.executable, "-c", _IMPORTS],
    **{
        f'python -c "import {name}"': [sys.executable, "-c", f"import {name}"]
        for name in ("numpy", "scipy.special", "pandas", "matplotlib.figure", "idtool.fit.staged")
    },
    "ffc-id --help": [_PROGRAM, "--help"],
    "ffc-id fit-gravity": [_PROGRAM, "fit-gravity", _GRAVITY, "-p", "params.toml"],
    "ffc-id fit-static": [_PROGRAM, "fit-static", _SWEEP, "-p", "params.toml"],
    "ffc-id fit-dynamic": [_PROGRAM, "fit-dynamic", _SINE, "-p", "params.toml"],
    "ffc-id fit-motion": [_PROGRAM, "fit-motion", _SINE, "-p", "motion.toml"],
    "ffc-id check": [_PROGRAM, "check", _SINE],
    "ffc-id import": [_PROGRAM, "import", _SINE, "-o", "log.csv", "--force"],
    "ffc-id run-sine": [_PROGRAM, "run-sine", "--rig", "sim:paper", "-o", "sine.csv", "--force"],
}


def measure(rounds: int = 5, tasks: tuple[str, ...] = tuple(TASKS)) -> Section:
    """Shortest processor times of several fresh processes, the caches warm."""
    section = Section(
        "Short commands",
        ["what", "processor time"],
        notes=[
            "Whole processes, user and system, on the logs of `ffc-id data get sample` (gravity 6,656 rows, "
            "sweep 41,804, sine 11,400). The first row is what the libraries of a fit take to import; SciPy "
            "and pandas, which a fit does without, and matplotlib, which only `--figure` asks for, follow "
            "(numpy is in each of them). The last import is everything that a fit needs before it computes. "
            "The search of a fit takes the rest, twice where the first fit leaves more than noise, as here, "
            "where a ripple is undeclared: then a softer bristle is tried too. `fit-motion` starts without a "
            "file every time, and simulates the sine some hundred times."
        ],
    )
    with tempfile.TemporaryDirectory() as folder:
        best = shortest({name: partial(_spent, TASKS[name], folder) for name in tasks}, rounds)
    for name, time in best.items():
        section.add(f"`{name}`", seconds(time))
        if "fit-" in name:
            section.below(name, time, _GOAL)
    return section


def _spent(words: list[str], folder: str) -> float:
    """Processor time of a process and its children, s."""
    Path(folder, "motion.toml").unlink(missing_ok=True)
    # modules are compiled once, as they are after an install
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(words, check=True, capture_output=True, cwd=folder, env=environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
