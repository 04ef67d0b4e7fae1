"""docs/diagnosis.md: the results of `studies.diagnosis` as tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from pages import markdown
from testbench.cases import DISTURBANCES, EFFECTS
from testbench.other_plants.effects import DISTURBANCES as OTHER_DISTURBANCES
from testbench.outcomes import AXES, KINDS, Result

_PAGE = "docs/diagnosis.md"


def write(results: Sequence[Result], path: Path, command: str) -> None:
    """Write what came of each kind of axes that were tried into its part of the page.

    Args:
        results: of all of them.
        path: of the page, or of a copy.
        command: that made it, but for `--kind`.
    """
    parts = {}
    for axis in AXES:
        if some := [r for r in results if r.case.axis == axis]:
            seconds = [r.seconds for r in some if np.isfinite(r.seconds)]
            spent = f"median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s" if seconds else "none"
            parts[axis] = [
                f"By `python -m studies.diagnosis --kind {axis} {command}`.",
                "",
                *_section(some),
                f"Processor time of a diagnosis (reading the logs included): {spent}.",
            ]
    markdown.write_made(_PAGE, parts, "study-diagnosis", path)


def _section(results: Sequence[Result]) -> list[str]:
    """What came of the axes of one kind."""
    none, one, several, unknown, real = ([r for r in results if r.case.kind == kind] for kind in KINDS)
    lines = [*_goals(none, one, several, unknown), "", "## No effect", ""]
    rows: list[tuple[object, ...]] = []
    for grade in sorted({r.sensors for r in results}):
        some = [r for r in none if r.sensors == grade]
        adequate = sum(r.verdict == "adequate" for r in some)
        rows.append((grade, len(some), sum(not r.extra for r in some), adequate))
    lines += markdown.table(("sensors", "sessions", "silent", "verdict adequate"), rows)
    lines += ["", *_wrong(none), "## One effect", ""]
    rows = []
    for name in EFFECTS:
        some = [r for r in one if r.case.what == (name,)]
        if not some:
            continue
        sizes = [r.size[0] for r in some if r.size and np.isfinite(r.size[0])]
        span = f"{min(sizes):.1f} to {max(sizes):.1f}" if sizes else "late readings"
        rows.append((name, len(some), sum(r.first for r in some), sum(r.named for r in some), span))
    lines += markdown.table(("effect", "sessions", "first", "exact", "sizes"), rows)
    lines += ["", *_wrong(one), "## Two or three effects", "", *_wrong(several), "## Not in the library", ""]
    rows = []
    for kind in dict.fromkeys([*DISTURBANCES, *OTHER_DISTURBANCES]):
        some = [r for r in unknown if r.case.what == (kind,)]
        if some:
            tests = (_unexplained, _right_variable, _falsely)
            rows.append((kind, len(some), *(sum(map(test, some)) for test in tests)))
    head = ("disturbance", "sessions", "unexplained", "right variable", "falsely explained")
    lines += markdown.table(head, rows)
    lines += ["", *_wrong(unknown, lambda r: _right_variable(r) and not _falsely(r))]
    if real:
        lines += ["## Like a real joint", "", *_real(real)]
    return [*lines, *_failures(results)]


def _real(results: Sequence[Result]) -> list[str]:
    """Effects that were there and named; those that were not there."""
    rows = []
    for name in dict.fromkeys(n for r in results for n in r.effects):
        some = [r for r in results if name in r.effects]
        named = sum(name in {n for f in r.found for n in (f, *r.alternatives.get(f, []))} for r in some)
        rows.append((name, len(some), named))
    false = Counter(n for r in results for n in r.extra)
    told = ", ".join(f"{n} ({k})" for n, k in false.most_common()) or "none"
    lines = markdown.table(("effect", "stands out", "named"), rows)
    return [*lines, "", f"Named though not there, in {len(results)} sessions: {told}.", ""]


def _failures(results: Sequence[Result]) -> list[str]:
    """What no session may have."""
    told = Counter(text for r in results for text in ((r.failed,) if r.failed else r.absurd))
    if not told:
        return []
    return ["## What no result may say", "", *(f"- {text}: {n}" for text, n in told.most_common()), ""]


#: Effects that multiply the Coulomb level, which is then that of a reference which the fit chooses.
_SCALES = {"position_dependent_friction", "thermal_drift"}


def _goals(
    none: Sequence[Result], one: Sequence[Result], several: Sequence[Result], unknown: Sequence[Result]
) -> list[str]:
    both = [*one, *several]
    level = [r for r in [*none, *both] if len(r.coulomb) == 3 and not _SCALES & {*r.effects}]
    rows = [
        ("no effect: one is found", "at most 1 %", _share(none, lambda r: bool(r.extra))),
        ("one effect: named first and alone", "at least 95 %", _share(one, lambda r: r.named)),
        ("two or three: the exact set", "at least 85 %", _share(several, lambda r: r.named)),
        (
            "the same where each adds 1 noise or more",
            "at least 85 %",
            _share([r for r in several if min(r.size, default=0.0) >= 1.0], lambda r: r.named),
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
            _share([r for r in both if r.declared], lambda r: r.after <= 1.1 * (r.declared or 0.0)),
        ),
        (
            "the same on a fresh run of another kind, by `ffc-id predict`",
            "at most 1.1 times",
            _share(
                [r for r in both if r.fresh_declared], lambda r: r.fresh <= 1.1 * (r.fresh_declared or 0.0)
            ),
        ),
        (
            "the true Coulomb level is in its interval, or within 2 % of it",
            "at least 93 %",
            _share(level, _holds_coulomb),
        ),
        (
            "an absurd number, or no result",
            "none",
            _share([*none, *both, *unknown], lambda r: bool(r.absurd or r.failed)),
        ),
    ]
    return markdown.table(("", "goal", "found"), rows)


def _holds_coulomb(result: Result) -> bool:
    true, low, high = result.coulomb
    return low - 0.02 * true <= true <= high + 0.02 * true


def _share(results: Sequence[Result], holds: Callable[[Result], bool]) -> str:
    count = sum(map(holds, results))
    return f"{count} of {len(results)} ({100.0 * count / max(len(results), 1):.1f} %)"


def _unexplained(result: Result) -> bool:
    return result.verdict == "unexplained"


def _right_variable(result: Result) -> bool:
    return _unexplained(result) and bool(set(result.variables) & set(result.depends_on))


def _falsely(result: Result) -> bool:
    return bool(result.extra)


def _wrong(results: Sequence[Result], right: Callable[[Result], bool] | None = None) -> list[str]:
    """What was not as it should be, each once."""
    fine = right or (lambda r: r.named)
    counted = Counter(
        f"{', '.join(r.effects or r.case.what) or 'none'} ({r.sensors}): {r.verdict or r.failed}, "
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
