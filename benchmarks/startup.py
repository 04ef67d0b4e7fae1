"""What a second process pays before it does anything: compiled code from the cache, and `--help`."""

from __future__ import annotations

import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from benchmarks.table import Section, seconds
from benchmarks.timing import shortest

_GOAL = 0.1
_IMPORTS = "import numpy, numba"
_CONTROLLER = "from idtool import ForceFreeController"
#: What is compiled runs once on a few rows; the time is printed by the process itself.
_KERNEL = """
import time
{imports}
began = time.perf_counter()
import numpy as np
from idtool.model import lugre
ones = np.ones(4)
first = np.array([True, False, False, False])
lugre.propagate(ones, ones, ones, first, np.zeros(1))
print(time.perf_counter() - began)
"""
#: Reading a motion and one differentiation touch every compiled function of a fit.
_WHOLE = """
import time
{imports}
import pandas, scipy.signal, scipy.sparse, scipy.optimize, scipy.stats, nlopt
began = time.perf_counter()
import numpy as np
from idtool.model import lugre
from idtool.signals import smoother
ones = np.ones(60)
first = np.arange(60) == 0
lugre.propagate(ones, ones, ones, first, np.zeros(1))
lugre.propagate_blocks(ones, ones, ones, first, np.zeros(1))[2](np.ones((4, 60)), ones, np.zeros((4, 60)))
t = 0.01 * np.arange(60)
smoother.smooth(t, np.sin(t), np.cos(t), first)
print(time.perf_counter() - began)
"""


def measure(rounds: int = 8) -> Section:
    """Shortest times of several fresh processes, the cache warm."""
    program = Path(sys.executable).with_name("ffc-id")
    tasks = {
        "python -c pass": [sys.executable, "-c", "pass"],
        "import numpy, numba": [sys.executable, "-c", _IMPORTS],
        _CONTROLLER: [sys.executable, "-c", _CONTROLLER],
        "ffc-id --help": [str(program), "--help"],
    }
    inside = {
        "propagate": _KERNEL.format(imports=_IMPORTS),
        "all that reading a log and a fit compile": _WHOLE.format(imports=_IMPORTS),
    }
    # the first round may have to fill the cache
    best = shortest(
        {name: partial(_lasted, command) for name, command in tasks.items()}
        | {name: partial(_told, script) for name, script in inside.items()},
        rounds,
    )
    section = Section(
        "A second process",
        ["what", "time"],
        notes=[
            "The upper part is the whole process. The lower part is timed inside a process that has numpy "
            "and numba imported already: importing our module, loading the compiled code from numba's cache "
            "and running it on a few rows. What numba itself would set up at the first compiled function of "
            "a process (its compiler's registries, which import scipy.linalg: 0.2 s) is left out by "
            "`idtool/model/jit.py`."
        ],
    )
    for name in tasks:
        section.add(f"`{name}`", seconds(best[name]))
    for name in inside:
        section.add(f"after numba: {name}", seconds(best[name]))
    what = "compiled code from the cache in a second process, without importing numba"
    section.below(what, best["propagate"], _GOAL)
    return section


def _lasted(command: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - began


def _told(script: str) -> float:
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    return float(done.stdout)
