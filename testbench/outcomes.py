"""Outcomes of the study of the diagnosis: how they are judged, and how a long run notes them and goes on."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field
from pathlib import Path

KINDS = ("none", "one effect", "several effects", "not in the library", "like a real joint")
#: Where the axis comes from: our simulated rig, or `testbench/other_plants`.
AXES = ("ours", "other")


@dataclass(frozen=True)
class Case:
    """One session to record.

    Attributes:
        kind: one of `KINDS`.
        seed: of everything.
        what: the effects in the plant, or the disturbance.
        axis: one of `AXES`.
        sensors, temperature, pauses, hard: of ours: the grade, whether the log has a temperature column,
            whether the run with pauses is in the session, and whether ramps are steep.
    """

    kind: str
    seed: int
    what: tuple[str, ...]
    axis: str = "ours"
    sensors: str = ""
    temperature: bool = True
    pauses: bool = False
    hard: bool = False


@dataclass(frozen=True)
class Result:
    """What came of it.

    Attributes:
        effects: that should be named.
        size: of each effect, root mean square of its torque over the noise of a reading.
        sensors: the grade.
        tolerated: what may be named and need not be.
        variables: what a disturbance is a function of.
        note: of the axis.
        verdict, found, alternatives, depends_on: of the diagnosis; `found` without inertia.
        before, after: error on held-out trials, N m.
        declared: the same with the true effects declared; None where there are none.
        fresh, fresh_declared: on the validation run.
        coulomb: true level, and the interval that was told.
        absurd: what no result may say.
        failed: the message, where there is no result.
        seconds: of the diagnosis.
    """

    case: Case
    effects: tuple[str, ...] = ()
    size: tuple[float, ...] = ()
    sensors: str = ""
    tolerated: tuple[str, ...] = ()
    variables: tuple[str, ...] = ()
    note: dict[str, str | float] = field(default_factory=dict)
    verdict: str = ""
    found: tuple[str, ...] = ()
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    depends_on: tuple[str, ...] = ()
    before: float = math.nan
    after: float = math.nan
    declared: float | None = None
    fresh: float = math.nan
    fresh_declared: float | None = None
    coulomb: tuple[float, ...] = ()
    absurd: tuple[str, ...] = ()
    failed: str = ""
    seconds: float = math.nan

    @property
    def extra(self) -> tuple[str, ...]:
        """What was named though it is not there and may not be."""
        allowed = {*self.effects, *self.tolerated}
        return tuple(n for n in self.found if not allowed & {n, *self.alternatives.get(n, [])})

    @property
    def named(self) -> bool:
        """Whether exactly what is there was named; an effect that ties with the true one counts as it."""
        found = [n for n in self.found if n in self.effects or n not in self.tolerated]
        return not self.failed and _same(self.effects, found, self.alternatives)

    @property
    def first(self) -> bool:
        """Whether the first effect named is there."""
        if not self.found:
            return False
        names = {self.found[0], *self.alternatives.get(self.found[0], [])}
        return bool(names & set(self.effects))


def _same(true: Sequence[str], found: Sequence[str], alternatives: dict[str, list[str]]) -> bool:
    left = list(true)
    tied: list[str] = []
    for name in found:
        match = next((n for n in (name, *alternatives.get(name, [])) if n in left), None)
        if match is None:
            return False
        left.remove(match)
        tied += [name, *alternatives.get(name, [])]
    return set(left) <= set(tied)  # two that are both there and cannot be told apart are named as such


def outcomes(todo: Iterable[Case], work: Callable[[Case], Result], notes: Path, jobs: int) -> list[Result]:
    """All sessions on so many cores; results are noted as they come, those noted stay."""
    known = _noted(notes) if notes.exists() else {}
    wanted = list(todo)
    notes.parent.mkdir(parents=True, exist_ok=True)
    left = [case for case in wanted if case not in known]
    with ProcessPoolExecutor(jobs) as pool, notes.open("a") as file:
        file.write("\n")  # after a line that was cut
        started = [pool.submit(work, case) for case in left]
        for number, done in enumerate(as_completed(started), 1):
            result = done.result()
            known[result.case] = result
            file.write(json.dumps(asdict(result)) + "\n")
            file.flush()
            print(f"{number} of {len(left)}: {', '.join(result.case.what) or 'none'}", file=sys.stderr)
    return [known[case] for case in wanted]


def _noted(notes: Path) -> dict[Case, Result]:
    found = {}
    for line in notes.read_text().splitlines():
        try:
            values = json.loads(line)
        except json.JSONDecodeError:
            continue  # cut while it was written
        case = values["case"]
        values["case"] = Case(**case | {"what": tuple(case["what"])})
        values |= {name: tuple(value) for name, value in values.items() if isinstance(value, list)}
        found[values["case"]] = Result(**values)
    return found
