"""docs/diagnosis.md: the results of `studies.diagnosis` as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from studies.diagnosis import GRADES, KINDS, Result
from testbench.cases import DISTURBANCES, EFFECTS

_HEAD = """# What the diagnosis finds, and what it finds that is not there

Made by `make study-diagnosis`. Every session is a random axis (`testbench/plants.py`), the packaged gravity,
sweep and sine runs (in some the run with pauses too), laboratory or DYNAMIXEL sensors in turn, with and
without a temperature column, and `identify` with the whole library. Effects add 1 to 10 times the sensor
noise of one reading (root mean square over the session; the few that cannot on that axis have what is
nearest). Disturbances that are not in the library are added to the current of the log (`testbench/cases.py`).

*Exact*: what was named is what is there, nothing more and nothing less; of two that tie the data cannot say
which, and naming the one with the other as its alternative counts. *First*: the first one named is there.
*Silent*: no effect is accepted besides inertia.
"""


def page(results: Sequence[Result]) -> str:
    """The whole page."""
    by_kind = {kind: [r for r in results if r.case.kind == kind] for kind in KINDS}
    none, one, several, unknown = (by_kind[kind] for kind in KINDS)
    lines = [_HEAD, *_goals(none, one, several, unknown)]
    lines += [
        "",
        "## No effect",
        "",
        "| sensors | sessions | silent | verdict adequate |",
        "|---|---|---|---|",
    ]
    for grade in GRADES:
        some = [r for r in none if r.case.sensors == grade]
        adequate = sum(r.verdict == "adequate" for r in some)
        lines.append(f"| {grade} | {len(some)} | {sum(not r.found for r in some)} | {adequate} |")
    lines += ["", *_wrong(none)]
    lines += ["## One effect", "", "| effect | sessions | first | exact | sizes |", "|---|---|---|---|---|"]
    for name in EFFECTS:
        some = [r for r in one if r.case.what == (name,)]
        sizes = [r.size[0] for r in some if np.isfinite(r.size[0])]
        span = f"{min(sizes):.1f} to {max(sizes):.1f}" if sizes else "late readings"
        lines.append(
            f"| {name} | {len(some)} | {sum(r.first for r in some)} | {sum(r.named for r in some)} | {span} |"
        )
    lines += ["", *_wrong(one), "## Two or three effects", "", *_wrong(several)]
    lines += [
        "## Not in the library",
        "",
        "| disturbance | sessions | unexplained | right variable | falsely explained |",
        "|---|---|---|---|---|",
    ]
    for kind in DISTURBANCES:
        some = [r for r in unknown if r.case.what == (kind,)]
        cells = [len(some), *(sum(map(test, some)) for test in (_unexplained, _right_variable, _falsely))]
        lines.append(f"| {kind} | {' | '.join(map(str, cells))} |")
    lines += ["", *_wrong(unknown, lambda r: _right_variable(r) and not _falsely(r))]
    seconds = [r.seconds for r in results]
    lines.append(
        f"Processor time of a diagnosis (reading the logs included): median {np.median(seconds):.1f} s, "
        f"longest {max(seconds):.1f} s."
    )
    return "\n".join(lines).rstrip() + "\n"


def _goals(
    none: Sequence[Result], one: Sequence[Result], several: Sequence[Result], unknown: Sequence[Result]
) -> list[str]:
    rows = [
        ("no effect: one is found", "at most 1 %", _share(none, lambda r: bool(r.found))),
        ("one effect: named first and alone", "at least 95 %", _share(one, lambda r: r.named)),
        ("two or three: the exact set", "at least 85 %", _share(several, lambda r: r.named)),
        (
            "the same where each adds 1 noise or more",
            "at least 85 %",
            _share([r for r in several if min(r.size) >= 1.0], lambda r: r.named),
        ),
        (
            "not in the library: unexplained, right variable",
            "at least 90 %",
            _share(unknown, _right_variable),
        ),
        ("not in the library: a false explanation", "at most 10 %", _share(unknown, _falsely)),
        (
            "error after, against the true effects declared: held-out trials",
            "at most 1.1 times",
            _share([*one, *several], lambda r: r.declared is not None and r.after <= 1.1 * r.declared),
        ),
        (
            "the same on a fresh run of another kind, by `ffc-id predict`",
            "at most 1.1 times",
            _share(
                [*one, *several], lambda r: r.fresh_declared is not None and r.fresh <= 1.1 * r.fresh_declared
            ),
        ),
    ]
    return ["| | goal | found |", "|---|---|---|", *(f"| {a} | {b} | {c} |" for a, b, c in rows)]


def _share(results: Sequence[Result], holds: Callable[[Result], bool]) -> str:
    count = sum(map(holds, results))
    return f"{count} of {len(results)} ({100.0 * count / max(len(results), 1):.1f} %)"


def _unexplained(result: Result) -> bool:
    return result.verdict == "unexplained"


def _right_variable(result: Result) -> bool:
    right = set(DISTURBANCES[result.case.what[0]].variables)
    return _unexplained(result) and bool(right & set(result.depends_on))


def _falsely(result: Result) -> bool:
    return bool(set(result.found) - set(DISTURBANCES[result.case.what[0]].partly))


def _wrong(results: Sequence[Result], right: Callable[[Result], bool] | None = None) -> list[str]:
    """What was not as it should be, each once."""
    fine = right or (lambda r: r.named)
    counted = Counter(
        f"{', '.join(r.case.what) or 'none'} ({r.case.sensors}): {r.verdict}, "
        f"found {', '.join(r.found) or 'none'}"
        for r in results
        if not fine(r)
    )
    if not counted:
        return ["All as it should be.", ""]
    return [
        "What was not:",
        "",
        *(f"- {text}" + (f", {n} times" if n > 1 else "") for text, n in counted.items()),
        "",
    ]


def write(results: Sequence[Result], path: Path) -> None:
    """Write the page."""
    path.write_text(page(results))
