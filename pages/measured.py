"""The page on recordings of real machines, from what `studies.measured` found."""

from __future__ import annotations

import math
from typing import Any

from pages.markdown import table
from testbench.recordings import RECORDINGS, Recording
from testbench.regression import STANDS_FOR

#: An effect of the regression counts from this share of the Coulomb level, per cent.
COUNTS = 5.0
#: The error may be this many times that of the regression.
AS_GOOD = 1.1
#: Beyond these multiples of the largest torque that was measured a prediction or a level is absurd.
_PREDICTED, _LEVEL = 1.5, 1.0 + 1e-6  # a bound may be one rounding above

TARGET, PAGE = "study-measured", "docs/measured.md"


def parts(found: dict[str, Any]) -> dict[str, list[str]]:
    """What is made of the page: part and lines."""
    done = [r for r in RECORDINGS if r.name in found]
    sections = [line for r in done for line in _section(r, found[r.name])]
    missing = [f"- Not run yet: {r.title}" for r in RECORDINGS if r.name not in found]
    columns = ((column, ", ".join(names)) for column, names in STANDS_FOR.items())
    return {
        "goals": _goals(done, found),
        "all": _overview(done, found),
        "emps": _emps(found),
        "others": _others(done, found),
        "beyond": _beyond(done, found),
        "recordings": [*sections, *missing],
        "columns": table(("column", "stands for it"), columns),
    }


def _counted(recordings: list[Recording]) -> list[Recording]:
    """Those that a model of one sliding axis can describe, each once."""
    return [r for r in recordings if not r.beyond and r.friction == "lugre"]


def unnamed(one: dict[str, Any]) -> list[dict[str, Any]]:
    """Columns of the regression that count and that nothing of the tool stands for."""
    there = {e["name"] for e in one.get("effects", [])} | set(one.get("of_the_readings", []))
    there |= {other for e in one.get("effects", []) for other in e["alternatives"] or []}
    there |= {"gravity"} if one.get("gravity") == "arm" else set()
    there |= {"friction"} if one.get("friction", "coulomb") != "coulomb" else set()
    return [t for t in _large(one) if not there & set(STANDS_FOR[t["name"]])]


def _large(one: dict[str, Any]) -> list[dict[str, Any]]:
    """What counts (inertia, which is in every model, does not); columns that the same effects stand for are
    one."""
    alike: dict[tuple[str, ...], list[dict[str, Any]]] = {}
    for term in one["regression"]["found"]:
        if term["name"] != "inertia":
            alike.setdefault(STANDS_FOR[term["name"]], []).append(term)
    joined = [
        terms[0]
        | {
            "said": ", ".join(t["said"] for t in terms),
            "percent_of_coulomb": math.hypot(*(t["percent_of_coulomb"] for t in terms)),
        }
        for terms in alike.values()
    ]
    return [term for term in joined if term["percent_of_coulomb"] >= COUNTS]


def _ratio(one: dict[str, Any], which: str) -> float | None:
    return one[which] / one["regression"][which] if one.get(which) is not None else None


def unconfirmed(one: dict[str, Any]) -> list[str]:
    """Named effects that have columns in the regression, none of which joined."""
    joined = {name for term in one["regression"]["found"] for name in STANDS_FOR[term["name"]]} | {"inertia"}
    known = {name for names in STANDS_FOR.values() for name in names}
    return [e["name"] for e in one.get("effects", []) if e["name"] in known - joined]


def _sane(one: dict[str, Any]) -> bool:
    return "refused" in one or (one["sane"]["predicted"] <= _PREDICTED and one["sane"]["level"] <= _LEVEL)


def _goals(done: list[Recording], found: dict[str, Any]) -> list[str]:
    counted = [found[r.name] for r in _counted(done)]
    large = sum(len(_large(one)) for one in counted)
    named = large - sum(len(unnamed(one)) for one in counted)
    goal = "every effect of the regression above 5 % of Coulomb is named"
    rows = [(goal, f"{named} of {large}", named == large)]
    for which, words in (("in_sample", "in sample"), ("held_out", "held out")):
        near = sum((_ratio(one, which) or 1e9) <= AS_GOOD for one in counted)
        goal = f"error {words} at most {AS_GOOD} of the regression's on four sets of five"
        rows.append((goal, f"{near} of {len(counted)}", near >= 0.8 * len(counted)))
    false = sum(len(unconfirmed(one)) for one in counted)
    names = sum(e["name"] != "inertia" for one in counted for e in one.get("effects", []))
    goal = "no false name (no column that joined confirms it)"
    rows.append((goal, f"{false} of {names} names", false == 0))
    if "emps" in found and "authors" in found["emps"]:
        error = found["emps"]["authors"]["in_sample"]
        rows.append(("EMPS below 2.2 % as its authors count", f"{error:.2f} %", error < 2.2))
        pulses = next(o for o in found["emps"]["others"] if o["name"] == "emps_pulses")
        if "emps_pulses" in found and "authors" in pulses:
            theirs = found["emps_pulses"]["authors"]["models"]["asymmetric"]["all"]
            goal = f"EMPS's pulses below the authors' asymmetric model ({theirs:.2f} %)"
            rows.append((goal, f"{pulses['authors']:.2f} %", pulses["authors"] < theirs))
    beyond = [found[r.name] for r in done]
    sane = sum(_sane(one) for one in beyond)
    rows.append(("refused, or no absurd number", f"{sane} of {len(beyond)}", sane == len(beyond)))
    return table(("goal", "reached", "met"), ((*cells, _yes(met)) for *cells, met in rows))


def _yes(met: bool) -> str:
    return "yes" if met else "**no**"


def _overview(done: list[Recording], found: dict[str, Any]) -> list[str]:
    columns = ("recording", "named", "columns above 5 % of Coulomb, not named", "in sample", "held out")
    return table(columns, (_cells(r, found[r.name]) for r in done))


def _cells(recording: Recording, one: dict[str, Any]) -> tuple[str, ...]:
    title = recording.title + (" (not counted)" if recording.beyond else "")
    lacking = [f"{t['said']}: {t['percent_of_coulomb']:.0f} %" for t in unnamed(one)]
    named = "refused" if "refused" in one else _named(one)
    return title, named, "; ".join(lacking) or "–", _pair(one, "in_sample"), _pair(one, "held_out")


def _named(one: dict[str, Any]) -> str:
    words = []
    for effect in one["effects"]:
        if effect["name"] == "inertia":  # of the base model
            continue
        share = effect["percent_of_torque"]
        name = effect["name"] + (f" {share:.0f} %" if share is not None else "")
        words.append(f"({name}?)" if effect["name"] in unconfirmed(one) else name)
    return ", ".join(words) or "none"


def _pair(one: dict[str, Any], which: str) -> str:
    theirs, ratio = one["regression"][which], _ratio(one, which)
    if ratio is None:
        return f"– / {theirs:.2f}"
    return f"{one[which]:.2f} / {theirs:.2f}{' !' if ratio > AS_GOOD else ''}"


def _emps(found: dict[str, Any]) -> list[str]:
    shown = [name for name in ("emps_textbook", "emps", "emps_pulses") if "authors" in found.get(name, {})]
    rows: list[tuple[str, ...]] = []
    for name in shown:
        authors, pulses = found[name]["authors"], name == "emps_pulses"
        where = "pulses" if pulses else "identification"
        held = f"{authors['held_out']:.2f} %" if "held_out" in authors else "–"
        ours = "ours, textbook" if name == "emps_textbook" else "ours"
        rows.append((ours, where, f"{authors['in_sample']:.2f} %", held, "–"))
        if name == "emps_textbook":
            continue
        for kind, theirs in authors["models"].items():
            printed = theirs["printed"][pulses]
            which = "predicted" if pulses else "fitted"
            errors = (f"{theirs[part]:.2f} %" for part in ("all", "held_out"))
            said = f"{printed} %" if printed else "–"
            rows.append((f"the authors', {kind} ({which})", where, *errors, said))
    for name in ("emps_textbook", "emps"):
        for other in found.get(name, {}).get("others", []):
            if "authors" in other:
                ours = "ours, textbook" if name == "emps_textbook" else "ours"
                error = f"predicted: {other['authors']:.2f} %"
                rows.append((f"{ours}, fitted to the identification", "pulses", error, "–", "–"))
    columns = ("model", "recording", "in sample", "on the held-out rows, fitted without them", "printed")
    return table(columns, rows)


def _others(done: list[Recording], found: dict[str, Any]) -> list[str]:
    titles = {r.name: r.title for r in RECORDINGS}
    rows = []
    for recording in done:
        for other in found[recording.name].get("others", []):
            error, theirs = f"refused: {other.get('refused')}", "–"
            if "refused" not in other:
                worse = " !" if other["error"] > AS_GOOD * other["regression"] else ""
                error, theirs = f"{other['error']:.2f} %{worse}", f"{other['regression']:.2f} %"
            rows.append((recording.title, titles[other["name"]], error, theirs))
    return table(("fitted to", "predicts", "error", "regression"), rows)


def _beyond(done: list[Recording], found: dict[str, Any]) -> list[str]:
    rows = []
    for recording in done:
        one = found[recording.name]
        if not recording.beyond and _sane(one):
            continue
        outcome, sizes = "refused", ["–", "–"]
        if "refused" not in one:
            outcome = f"`{one['verdict']}`"
            sizes = [f"{one['sane'][what]:.2f}" for what in ("predicted", "level")]
        rows.append((recording.title, recording.beyond or "one axis", outcome, *sizes, _yes(_sane(one))))
    columns = (
        *("recording", "why", "outcome"),
        *("largest prediction / measured", "largest level / measured", "sane"),
    )
    return table(columns, rows)


def _section(recording: Recording, one: dict[str, Any]) -> list[str]:
    lines = [f"### {recording.title}", "", f"{recording.source}. File: {recording.file}.", ""]
    if recording.remark:
        lines += [recording.remark, ""]
    if "refused" in one:
        return [*lines, f"Refused: {one['refused']}", ""]
    if one["published"]:
        lines += [*table(("", "published", "found"), one["published"]), ""]
    lines += [
        f"Verdict `{one['verdict']}`, friction law `{one['friction']}`; named: {_named(one)}.",
        f"{one['rows']:,} rows; {one['moving']:,} thinned ones move; {one['seconds']:.1f} s of one core.",
    ]
    if one["unexplained"]:
        lines.append(f"Unexplained: {one['unexplained']}")
    if one.get("held_out_refused"):
        lines.append(f"Without the held-out rows refused: {one['held_out_refused']}")
    columns = [f"{t['said']} {t['percent_of_coulomb']:.0f} %" for t in one["regression"]["found"]]
    lines.append(f"The regression's columns, shares of Coulomb: {', '.join(columns) or 'none'}.")
    return [*lines, *_misses(one), ""]


def _why_not(one: dict[str, Any], term: dict[str, Any]) -> str:
    """What the tool itself says of the effects that a column stands for, in brackets."""
    turned_down = one.get("turned_down", {})
    said = [f"{name}: {turned_down[name]}" for name in STANDS_FOR[term["name"]] if name in turned_down]
    return f" ({'; '.join(said)})" if said else ""


def _misses(one: dict[str, Any]) -> list[str]:
    missed = [f"not named: {t['said']}{_why_not(one, t)}" for t in unnamed(one)]
    missed += [f"no column confirms {name}" for name in unconfirmed(one)]
    for which, words in (("in_sample", "in sample"), ("held_out", "held out")):
        ratio = _ratio(one, which)
        if ratio is not None and ratio > AS_GOOD:
            missed.append(f"error {words} {ratio:.2f} times the regression's")
    if not _sane(one):
        missed.append("a number beyond what was measured")
    return [f"Missed: {'; '.join(missed)}."] if missed else []
