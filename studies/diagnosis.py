"""What the diagnosis finds on many axes, and what it finds that is not there.

Every session: a random axis with effects or without, `diagnose` with the whole library and with the true
effects alone, and a fresh run that nothing has seen. Axes are of our simulated rig and of
`testbench/other_plants`, which shares no code with it. Outcomes are noted as they come, so that a run that
was cut goes on.

python -m studies.diagnosis [--kind ours|other] [--null N] [--single N] ... [--jobs N]  (make study-diagnosis)
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from idtool.diagnosis.diagnose import diagnose
from idtool.diagnosis.diagnosis import Diagnosis
from idtool.diagnosis.summary import found as found_effects
from idtool.effects import registry
from idtool.effects.base import Effect
from idtool.log import Log
from idtool.signals import record as as_recording
from idtool.verbs.base_model import base_model
from idtool.verbs.identification import parameters_of
from idtool.verbs.predict import predict
from pages import markdown
from studies.diagnosis_page import write
from testbench.diagnosis_cases import Recorded, cases, record
from testbench.judging import absurdities
from testbench.outcomes import AXES, Case, Result, outcomes

LIBRARY = {effect.name for effect in registry.library()}


def one_session(case: Case) -> Result:
    """Draw, record, diagnose; a failure is a result too."""
    session = record(case)
    known = session.known
    start = time.process_time()
    try:
        found = _diagnose(session.logs, registry.library())
        seconds = time.process_time() - start
        library = [registry.get(n) for n in (*known.effects, "inertia") if n in LIBRARY]
        whole = bool(known.effects) and len(library) > len(known.effects)
        declared = _diagnose(session.logs, library) if whole else None
        return replace(_judged(session, found, declared), seconds=seconds)
    except Exception as error:  # any failure on a fair log is a miss, and must not end a long study
        return replace(known, failed=f"{type(error).__name__}: {error}"[:200])


def _judged(session: Recorded, found: Diagnosis, declared: Diagnosis | None) -> Result:
    document = found.to_document()
    held = document["error"]["held_out"]
    effects = found_effects(document)
    parameters = parameters_of(found.final)
    error, most = _on(session.fresh, found)
    level = parameters.static["coulomb"]
    return replace(
        session.known,
        verdict=document["verdict"],
        found=tuple(e["name"] for e in effects),
        alternatives={e["name"]: e["alternatives"] for e in effects},
        depends_on=tuple((document["unexplained"] or {"depends_on": ()})["depends_on"]),
        before=held["before"],
        after=held["after"],
        declared=declared.to_document()["error"]["held_out"]["after"] if declared else None,
        fresh=error,
        fresh_declared=_on(session.fresh, declared)[0] if declared else None,
        coulomb=(session.coulomb, *(level.ci95 or ())),
        absurd=tuple(absurdities(parameters, session.logs, most)),
    )


def _diagnose(logs: list[Log], library: Sequence[Effect]) -> Diagnosis:
    recording = as_recording(logs)
    starts = base_model(recording, "lugre", "auto").fits
    return diagnose(recording, starts, library)


def _on(log: Log, diagnosis: Diagnosis) -> tuple[float, float]:
    """Error on a run of another kind, as `ffc-id predict` tells it, and the largest prediction."""
    prediction = predict([log], parameters_of(diagnosis.final))
    (error,) = prediction.errors.values()
    column = next(c for c in map(str, prediction.frame) if "predicted" in c)
    return error["rmse"], float(np.nanmax(np.abs(prediction.frame[column])))


@click.command()
@click.option(
    "--kind", type=click.Choice(["both", *AXES]), default="both", show_default=True, help="Of axes."
)
@click.option("--null", default=200, show_default=True, help="Sessions without an effect.")
@click.option("--single", default=8, show_default=True, help="Sessions with each one of the effects.")
@click.option("--several", default=60, show_default=True, help="Sessions with two or three.")
@click.option("--unknown", default=8, show_default=True, help="Sessions with each disturbance.")
@click.option("--real", default=40, show_default=True, help="Sessions like a real joint (other axes).")
@click.option("--jobs", default=os.cpu_count() or 1, show_default="all cores", help="Sessions at a time.")
@markdown.out_option("docs/diagnosis.md")
@click.option(
    "--notes",
    type=click.Path(path_type=Path),
    default=Path("build/study-diagnosis.jsonl"),
    show_default=True,
    help="Outcome of every session; a run that was cut goes on from it. Remove it when the program changed.",
)
def main(
    kind: str,
    null: int,
    single: int,
    several: int,
    unknown: int,
    real: int,
    jobs: int,
    out: Path,
    notes: Path,
) -> None:
    """Run the study and write the page."""
    axes = AXES if kind == "both" else (kind,)
    todo = cases(axes, null, single, several, unknown, real)
    numbers = f"--null {null} --single {single} --several {several} --unknown {unknown} --real {real}"
    write(outcomes(todo, one_session, notes, jobs), out, numbers)
    click.echo(f"written: {out}")


if __name__ == "__main__":
    main()
