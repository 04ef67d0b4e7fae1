"""`identify` where it is hard: an axis with three effects, and with something that no effect accounts for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

from benchmarks.table import Section, seconds
from benchmarks.timing import once
from idtool import Log
from idtool.diagnosis.summary import found
from idtool.verbs.identify import identify
from testbench.cases import disturb
from testbench.plants import Plant, record_session

_ROWS, _MORE_ROWS = 25_000, 120_000
_GOAL, _MORE_GOAL = 6.0, 20.0
_CLEAN = Plant(0.080, 0.110, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)
_EFFECTS: Mapping[str, dict[str, float]] = {
    "position_ripple": {
        "cycles_per_turn": 24.0,
        "amplitude_1_nm": 0.012,
        "phase_1_rad": 0.7,
        "amplitude_2_nm": 0.003,
        "phase_2_rad": -1.1,
    },
    "direction_asymmetry": {"asymmetry_nm_s_per_rad": 0.03},
    "position_stiffness": {"stiffness_nm_per_rad": 0.03, "neutral_rad": 0.4},
}
_DISTURBANCE, _DISTURBANCE_NM = "bump at one speed", 0.012
_SEED = 4


def logs_of(axis: str, rows: int) -> list[Log]:
    """A session of the clean axis, of one with three effects, or of that with a disturbance as well: every so
    manieth row of it, or with as many more sweeps as the rows need."""
    plant = _CLEAN if axis == "clean" else replace(_CLEAN, effects=dict(_EFFECTS))
    logs = record_session(plant, "lab", _SEED)
    while (whole := sum(len(log.frame) for log in logs)) < rows:
        logs += record_session(plant, "lab", _SEED + len(logs), ("sweep",))
    if axis == "three effects and something unknown":
        logs = disturb(logs, _DISTURBANCE, _SEED, _DISTURBANCE_NM)
    step = -(-whole // rows) if whole > 1.5 * rows else 1
    return [replace(log, rows=log.frame.iloc[::step].reset_index(drop=True)) for log in logs]


def measure(sizes: tuple[int, ...] = (_ROWS, _MORE_ROWS)) -> Section:
    """Time `identify` of each once, after one that compiles and warms up."""
    section = Section(
        "identify where it is hard",
        ["axis", "rows", "processor time", "against clean", "named", "verdict"],
        notes=[
            "One axis of the simulated rig: clean, with a ripple, an asymmetry and a cable, and with those "
            f"and a {_DISTURBANCE} that is in no library ({1e3 * _DISTURBANCE_NM:.0f} mN m). One run each, "
            "in a warm process."
        ],
    )
    identify(logs_of("clean", sizes[0]))
    for rows in sizes:
        clean = 0.0
        for axis in ("clean", "three effects", "three effects and something unknown"):
            logs = logs_of(axis, rows)
            done, took = once(partial(identify, logs))
            clean = clean or took
            told = done.diagnosis
            named = ", ".join(e["name"] for e in found(told)) or "none"
            exact = sum(len(log.frame) for log in logs)
            section.add(axis, f"{exact:,}", seconds(took), f"{took / clean:.1f}", named, told["verdict"])
        if rows in (_ROWS, _MORE_ROWS):
            what = f"identify of {rows:,} rows with three effects and something unknown"
            section.below(what, took, _GOAL if rows == _ROWS else _MORE_GOAL)
    return section
