"""BAM's own models fitted to what docs/simulation.md fits ours to, and judged alike: docs/bam.json.

python -m studies.bam [--folder FOLDER]        (make study-bam, twenty minutes of one core)

`make study-simulate` then writes the page.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import click

from idtool.io.atomic import atomic_write
from idtool.log import Log
from pages.simulation import BAM, SOURCES, WHOLE
from studies.measured import default_folder
from testbench.bam import MODELS, SPLITS, Swings, bam_logs, search

SEEDS = (1, 2, 3)


@dataclass(frozen=True)
class Fitted:
    """One fit of one model.

    Attributes:
        model, seed: which.
        fitted: mean absolute error on the logs that it was fitted to, from the goals, mrad.
        goal, effort: that on each log that was left out, from the goals and from the duty, mrad.
        evaluations: how often the logs were simulated.
        seconds: processor time.
        values: the parameters found.
    """

    model: str
    seed: int
    fitted: float
    goal: list[float]
    effort: list[float]
    evaluations: int
    seconds: float
    values: dict[str, float]


def fit(model: str, seed: int, logs: Swings, out: Swings) -> Fitted:
    """Fit a model to some logs and judge it on others."""
    begin = time.process_time()
    values, evaluations = search(logs, model, seed)
    seconds = time.process_time() - begin
    goal, effort = (_rounded([1e3 * one for one in out.errors(values, source)]) for source in SOURCES)
    (fitted,) = _rounded([1e3 * logs.cost(values)])
    return Fitted(model, seed, fitted, goal, effort, evaluations, round(seconds, 1), values)


def _rounded(errors: Sequence[float]) -> list[float]:
    return [round(one, 3) for one in errors]


def fits_of(logs: Mapping[tuple[int, str], Log], left_out: Sequence[tuple[int, str]]) -> list[Fitted]:
    """Every model and seed without some logs, judged on these; on all where none is left out."""
    kept = Swings.of([log for key, log in logs.items() if key not in left_out])
    out = Swings.of([logs[key] for key in left_out or logs])
    return [fit(model, seed, kept, out) for model in MODELS for seed in SEEDS]


@click.command()
@click.option("--folder", type=click.Path(path_type=Path), default=default_folder)
def main(folder: Path) -> None:
    """Write docs/bam.json, split by split."""
    logs = bam_logs(folder)
    document: dict[str, object] = {}
    for title, out in {**SPLITS, WHOLE: []}.items():
        document[title] = [asdict(one) for one in fits_of(logs, out)]
        with atomic_write(BAM) as stream:
            stream.write(json.dumps(document, indent=1) + "\n")
        click.echo(title)


if __name__ == "__main__":
    main()
