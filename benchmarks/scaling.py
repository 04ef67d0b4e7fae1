"""Time and memory over the number of rows, each size in a process of its own."""

from __future__ import annotations

import json
import re
import resource
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.sessions import log_of, repeated
from benchmarks.table import Goal, Section, seconds
from benchmarks.timing import once
from idtool.effects import registry
from idtool.fit.model import JointModel
from idtool.fit.spec import Spec
from idtool.log import Log
from idtool.signals import record

_SIZES = (10_000, 100_000, 1_000_000, 10_000_000)
_ROOT = Path(__file__).resolve().parent.parent
_MOST_BYTES = 12e9
_SLOPE = 1.15
_ROUNDS_ROWS = 2_000_000  # sizes below are repeated until so many rows have gone through
_SPEC = Spec("lugre", None, ())
_VALUES = {
    "coulomb": 0.07,
    "static": 0.03,
    "stribeck_velocity": 0.09,
    "viscous": 0.155,
    "bristle_stiffness": 0.051,
    "bristle_damping": 0.297,
    "inertia.inertia": 0.006,
}
_STAGES = ("record", "filter", "evaluate", "differentiate")
_TITLES = ("reading the motion", "building the filter", "one evaluation", "one differentiation")


def measure(sizes: tuple[int, ...] = _SIZES, *, apart: bool = True) -> Section:
    """A table of sizes, and the slope of time over rows in the log-log plane.

    Unless `apart`, all sizes go through this process, whose memory then says little.
    """
    section = Section(
        "Time and memory over the number of rows",
        ["rows", *_TITLES, "µs a row", "highest memory", "bytes a row"],
    )
    results = []
    for size in sizes:
        results.append(_apart(size) if apart else one(size))
        found = results[-1]
        total = sum(found["time"].values())
        section.add(
            size,
            *(seconds(found["time"][stage]) for stage in _STAGES),
            1e6 * total / size,
            f"{found['peak'] / 1e6:,.0f} MB",
            (found["peak"] - found["before"]) / size,
        )
    totals = [sum(found["time"].values()) for found in results]
    slope = float(np.polyfit(np.log(sizes), np.log(totals), 1)[0])
    last = results[-1]
    stages = ", ".join(
        f"{title} {max(last['stages'][stage] - last['before'], 0) / sizes[-1]:.0f}"
        for stage, title in zip(_STAGES, _TITLES, strict=True)
    )
    section.notes += [
        f"Slope of the total over rows in the log-log plane: {slope:.2f}. The four sines of `sim:paper` "
        "over and over, every repetition with trials of its own (four per 11,400 rows); LuGre and inertia, "
        "seven parameters. Each size in a process of its own; shortest of several runs up to a million rows.",
        "*Highest memory* is that of the process, with Python, its packages and the log itself; *bytes a "
        f"row* leaves out what was there before the first stage. At {sizes[-1]:,} rows the highest so far, "
        f"in bytes a row, was after {stages}.",
    ]
    section.goals += [
        Goal(f"time over rows: slope of about 1 (at most {_SLOPE})", f"{slope:.2f}", slope <= _SLOPE),
        Goal(
            f"{sizes[-1]:,} rows in less than {_MOST_BYTES / 1e9:.0f} GB",
            f"{last['peak'] / 1e9:.1f} GB",
            last["peak"] < _MOST_BYTES,
        ),
    ]
    return section


def _apart(rows: int) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.scaling", str(rows)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=_ROOT)
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def one(rows: int) -> dict[str, Any]:
    """Times, s, and memory, bytes, at one size."""
    base = log_of("sine")
    _pass(base, {})  # compiles and warms up
    log = repeated(base, rows)
    before = resident()
    best: dict[str, float] = dict.fromkeys(_STAGES, float("inf"))
    stages: dict[str, int] = {}
    for _ in range(min(max(1, _ROUNDS_ROWS // rows), rows // 500)):
        times = _pass(log, stages)
        best = {stage: min(best[stage], times[stage]) for stage in _STAGES}
    return {"time": best, "before": before, "peak": peak(), "stages": stages}


def _pass(log: Log, stages: dict[str, int]) -> dict[str, float]:
    times: dict[str, float] = {}

    def timed(stage: str, task: Callable[[], Any]) -> Any:
        result, times[stage] = once(task)
        stages.setdefault(stage, peak())
        return result

    recording = timed("record", lambda: record([log]))
    spec = _SPEC.adding(registry.get("inertia"))
    model = JointModel.build(recording, spec)
    timed("filter", lambda: (model.measured, recording.stretch_pointer))
    x = model.coordinates(_VALUES)
    bend = model.presliding_scale(x)
    evaluation = timed("evaluate", lambda: model.evaluate(x, bend))
    timed("differentiate", lambda: model.differentiate(x, bend, evaluation.start))
    return times


def peak() -> int:
    """The most memory this process has held, bytes."""
    # what getrusage says starts at the peak of the process that started this one
    return _status("VmHWM") or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def resident() -> int:
    """The memory this process holds now, bytes; the most so far where the system does not say."""
    return _status("VmRSS") or peak()


def _status(key: str) -> int:
    try:
        found = re.search(rf"{key}:\s*(\d+) kB", Path("/proc/self/status").read_text())
    except OSError:
        return 0
    return int(found[1]) * 1024 if found else 0


if __name__ == "__main__":
    print(json.dumps(one(int(sys.argv[1]))))
