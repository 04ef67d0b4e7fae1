"""`identify` of a session of about 42,000 rows: how long, and where the time goes."""

from __future__ import annotations

import cProfile
import pstats
from collections.abc import Sequence

from benchmarks.sessions import log_of
from benchmarks.table import Section, seconds
from benchmarks.timing import interleaved
from idtool import Log
from idtool.signals import record
from idtool.verbs.base_model import base_model
from idtool.verbs.identify import identify

_FIT_GOAL, _WHOLE_GOAL = 1.5, 10.0
#: Every second payload, three speeds and the four sines: 42,168 rows.
_GRAVITY, _SWEEP = tuple(range(0, 16, 2)), (1, 3, 5)
#: stage -> function whose time, with all that it calls, it is; indented ones are parts of the one above.
_STAGES = (
    ("reading the motion", "recording.py", "record"),
    ("— smoothing", "smoother.py", "smooth"),
    ("first fits", "choose.py", "first_fits"),
    ("— global search", "search.py", "search"),
    ("diagnosis", "diagnose.py", "diagnose"),
    ("— scoring candidate effects", "candidates.py", "best_start"),
    ("—— spectral lines of periodic effects", "lines.py", "strongest_line"),
    ("— refitting promising ones", "candidates.py", "try_effect"),
    ("— other shapes of the friction curve", "restart.py", "restart"),
    ("— errors of prediction", "left_out.py", "prediction_errors"),
    ("— what the residual depends on", "residual.py", "test_residual"),
)
#: the same time cut another way: what all stages above spend it on
_WORK = (
    ("all least squares", "joint.py", "solve"),
    ("— evaluations", "model.py", "evaluate"),
    ("— differentiations", "model.py", "differentiate"),
    ("the filter, anywhere", "recording.py", "filtered"),
    ("the compiled LuGre step, anywhere", "lugre.py", "propagate"),
    ("", "lugre.py", "propagate_blocks"),
    ("", "lugre.py", "tangents"),
)


def measure(
    gravity: tuple[int, ...] = _GRAVITY,
    sweep: tuple[int, ...] = _SWEEP,
    sine: tuple[int, ...] = (),
    rounds: int = 4,
) -> Section:
    """Time `identify` with and without the diagnosis, and profile it."""
    logs = [log_of("gravity", trials=gravity), log_of("sweep", trials=sweep), log_of("sine", trials=sine)]
    rows = sum(len(log.frame) for log in logs)

    def fits_only() -> None:
        base_model(record(logs), "lugre", "auto")

    best = interleaved({"fits": fits_only, "whole": lambda: identify(logs)}, rounds)
    profile = cProfile.Profile()
    profile.enable()
    verdict = identify(logs).diagnosis["verdict"]
    profile.disable()
    section = Section(
        f"identify of {rows:,} rows",
        ["stage", "time", "share"],
        notes=[
            "Without diagnosis (reading the motion and the joint fit of the base model): "
            f"{seconds(best['fits'])}. With the whole library of effects: {seconds(best['whole'])}; verdict "
            f"`{verdict}`. In a warm process.",
            "Stages with all that they call, from `cProfile`, which slows small calls down. A dash marks a "
            "part of the stage above; the last rows cut the same time another way.",
        ],
    )
    _stages(section, profile, logs)
    section.below(f"identify of {rows:,} rows without diagnosis", best["fits"], _FIT_GOAL)
    section.below(f"identify of {rows:,} rows with the whole library", best["whole"], _WHOLE_GOAL)
    return section


def _stages(section: Section, profile: cProfile.Profile, logs: Sequence[Log]) -> None:
    found: dict[tuple[str, str], float] = {}
    table = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    for (file, _, function), (_, _, _, cumulative, _) in table.items():
        if "idtool" in file:
            found[file.replace("\\", "/").rsplit("/", 1)[-1], function] = cumulative
    whole = found["identify.py", "identify"]
    section.add("identify", seconds(whole), "100 %")
    merged: list[tuple[str, float]] = []
    for name, file, function in (*_STAGES, *_WORK):
        took = found.get((file, function), 0.0)
        if name:
            merged.append((name, took))
        else:
            merged[-1] = (merged[-1][0], merged[-1][1] + took)
    for name, took in merged:
        section.add(name, seconds(took) if took else "0", f"{100.0 * took / whole:.0f} %")
