"""What the diagnosis finds on many axes, and what it finds that is not there.

Every session: a random axis, the packaged gravity, sweep and sine runs, `diagnose` with the whole
library, and a fresh validation run that nothing has seen.

python -m studies.diagnosis [--null N] [--single N] [--several N] [--unknown N]     (make study-diagnosis)
"""

from __future__ import annotations

import json
import math
import os
import time
import zlib
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path

import click
import numpy as np

from idtool.diagnosis.diagnose import Diagnosis, diagnose
from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.log import Log
from idtool.signals import record
from idtool.verbs.identify import begin, parameters_of
from idtool.verbs.predict import predict
from testbench.cases import DISTURBANCES, EFFECTS, disturb, draw_effects, noise_of
from testbench.plants import SESSION, between, random_plant, record_session

GRADES = ("lab", "dynamixel")
LIBRARY = {effect.name for effect in registry.library()}
KINDS = ("none", "one effect", "several effects", "not in the library")


@dataclass(frozen=True)
class Case:
    """One session to record.

    Attributes:
        kind: one of `KINDS`.
        seed: of everything.
        what: the effects in the plant, or the disturbance.
        sensors: the grade.
        temperature: whether the log has a temperature column.
        pauses: whether the run with pauses is in the session too.
    """

    kind: str
    seed: int
    what: tuple[str, ...]
    sensors: str
    temperature: bool
    pauses: bool


@dataclass(frozen=True)
class Result:
    """What came of it.

    Attributes:
        size: of each effect, root mean square over the sensor noise.
        verdict, found, alternatives, depends_on: of the diagnosis; `found` without inertia.
        before, after: error on held-out trials, N m.
        declared: the same with the true effects declared; None where there are none.
        fresh, fresh_declared: on the validation run.
        seconds: of the diagnosis.
    """

    case: Case
    size: tuple[float, ...] = ()
    verdict: str = ""
    found: tuple[str, ...] = ()
    alternatives: dict[str, list[str]] = field(default_factory=dict)
    depends_on: tuple[str, ...] = ()
    before: float = math.nan
    after: float = math.nan
    declared: float | None = None
    fresh: float = math.nan
    fresh_declared: float | None = None
    seconds: float = math.nan

    @property
    def named(self) -> bool:
        """Whether exactly what is there was named; an effect that ties with the true one counts as it."""
        return _same(self.case.what, self.found, self.alternatives)

    @property
    def first(self) -> bool:
        """Whether the first effect named is there."""
        if not self.found:
            return False
        names = {self.found[0], *self.alternatives.get(self.found[0], [])}
        return bool(names & set(self.case.what))


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


def cases(null: int, single: int, several: int, unknown: int) -> Iterator[Case]:
    """All sessions; grades and the temperature column take turns."""

    def case(kind: str, number: int, what: tuple[str, ...]) -> Case:
        seed = zlib.crc32(repr((kind, number, what)).encode())
        grade = GRADES[number % 2]
        # what pauses show cannot be found without them
        pauses = "breakaway_dwell" in what or number // 4 % 2 == 1
        return Case(kind, seed, what, grade, number // 2 % 2 == 0, pauses)

    yield from (case("none", k, ()) for k in range(null))
    for name in EFFECTS:
        yield from (case("one effect", k, (name,)) for k in range(single))
    rng = np.random.default_rng(7)
    for k in range(several):
        names = rng.choice(list(EFFECTS), size=2 + k % 2, replace=False)
        yield case("several effects", k, tuple(str(name) for name in names))
    for name in DISTURBANCES:
        yield from (case("not in the library", k, (name,)) for k in range(unknown))


def one_session(case: Case) -> Result:
    """Draw, record, diagnose."""
    rng = np.random.default_rng(case.seed)
    plant = random_plant(rng)
    unknown = case.kind == "not in the library"
    session = (*SESSION, "pauses") if case.pauses else SESSION
    truth = draw_effects(plant, () if unknown else case.what, rng, case.sensors, session)
    logs = record_session(
        truth.plant, case.sensors, case.seed, (*session, "validation"), temperature=case.temperature
    )
    size = truth.size
    if unknown:
        size = (between(rng, 1.0, 10.0),)
        logs = disturb(logs, case.what[0], case.seed, size[0] * noise_of(case.sensors))
    start = time.process_time()
    found = _diagnose(logs[:-1], registry.library())
    seconds = time.process_time() - start
    document = found.to_document()
    held = document["error"]["held_out"]
    library = [registry.get(n) for n in (*case.what, "inertia") if n in LIBRARY]
    declared = _diagnose(logs[:-1], library) if truth.effects and len(library) > len(truth.effects) else None
    effects = [e for e in document["effects"] if e["name"] != "inertia"]
    return Result(
        case,
        size,
        document["verdict"],
        tuple(e["name"] for e in effects),
        {e["name"]: e["alternatives"] for e in effects},
        tuple((document["unexplained"] or {"depends_on": ()})["depends_on"]),
        held["before"],
        held["after"],
        declared and declared.to_document()["error"]["held_out"]["after"],
        _fresh_error(found, logs[-1]),
        declared and _fresh_error(declared, logs[-1]),
        seconds,
    )


def _diagnose(logs: list[Log], library: Sequence[Effect]) -> Diagnosis:
    recording = record(logs)
    first, spec, *_ = begin(recording, "lugre", "auto")
    return diagnose(recording, first, spec, library)


def _fresh_error(diagnosis: Diagnosis, log: Log) -> float:
    """Error on a run of another kind, as `ffc-id predict` tells it."""
    (error,) = predict([log], parameters_of(diagnosis.final)).errors.values()
    return error["rmse"]


def study(todo: Iterable[Case], notes: Path | None = None) -> list[Result]:
    """All sessions, on the cores there are; results are noted as they come; those noted stay."""
    known = _noted(notes) if notes is not None and notes.exists() else {}
    cases = list(todo)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for result in pool.map(one_session, [case for case in cases if case not in known]):
            known[result.case] = result
            if notes is not None:
                with notes.open("a") as file:
                    file.write(json.dumps(asdict(result)) + "\n")
    return [known[case] for case in cases]


def _noted(notes: Path) -> dict[Case, Result]:
    found = {}
    for line in notes.read_text().splitlines():
        values = json.loads(line)
        case = values["case"]
        values["case"] = Case(**case | {"what": tuple(case["what"])})
        values |= {name: tuple(values[name]) for name in ("size", "found", "depends_on")}
        found[values["case"]] = Result(**values)
    return found


@click.command()
@click.option("--null", default=200, show_default=True, help="Sessions without an effect.")
@click.option("--single", default=8, show_default=True, help="Sessions with each one of the effects.")
@click.option("--several", default=60, show_default=True, help="Sessions with two or three.")
@click.option("--unknown", default=8, show_default=True, help="Sessions with each disturbance.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("docs/diagnosis.md"))
@click.option(
    "--notes", type=click.Path(path_type=Path), help="A file for every result as it comes, to go on with."
)
def main(null: int, single: int, several: int, unknown: int, out: Path, notes: Path | None) -> None:
    """Run the study and write the page."""
    from studies.diagnosis_page import write

    write(study(cases(null, single, several, unknown), notes), out)
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
