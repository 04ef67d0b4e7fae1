"""BAM's own models fitted to what docs/simulation.md fits ours to, and judged alike: docs/bam.json.

python -m studies.bam [--folder FOLDER]        (make study-bam, twenty minutes of one core)

`make study-simulate` then writes the page. Searched by CMA-ES as BAM does, from the middle of the ranges and
then from points drawn in them, until as many evaluations are spent or a search comes to the same end as the
best one before it.

Source: Hansen, "The CMA Evolution Strategy: A Tutorial", 2016, by his own package (`cma`).
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import numpy as np

from idtool.io.atomic import atomic_write
from idtool.log import Log
from idtool.model.motion import Array
from studies.measured import default_folder
from studies.simulate import BAM, SOURCES, SPLITS, WHOLE, bam_logs
from testbench.bam import MODELS, RANGES, Swings

SEEDS = (1, 2, 3)
EVALUATIONS = 30_000
#: Points of a generation, and the first spread as a share of the ranges.
_POPULATION, _SPREAD = 30, 1.0 / 6.0
#: A search ends where the cost of all points differs by less, rad.
_FINE = 1e-6
#: Two searches that end within this share of each other came to the same end.
_SAME = 0.005


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


def search(
    swings: Swings, model: str, seed: int, evaluations: int = EVALUATIONS
) -> tuple[dict[str, float], int]:
    """A model's parameters by CMA-ES, and how often the logs were simulated."""
    import cma

    names = MODELS[model]
    low, high = np.array([RANGES[name] for name in names]).T

    def values_at(share: Array) -> dict[str, float]:
        return dict(zip(names, (low + share * (high - low)).tolist(), strict=True))

    random = np.random.default_rng(seed)
    start, best, least, spent = np.full(len(names), 0.5), {}, np.inf, 0
    while evaluations - spent >= _POPULATION:
        options = {
            "bounds": [0.0, 1.0],
            "popsize": _POPULATION,
            "maxfevals": evaluations - spent,
            "tolfun": _FINE,
            "tolfunhist": 0.1 * _FINE,
            "seed": int(random.integers(1, 2**31)),
            "verbose": -9,
        }
        strategy = cma.CMAEvolutionStrategy(start, _SPREAD, options)
        found = strategy.optimize(lambda share: swings.cost(values_at(share))).result
        spent += int(found.evaluations)
        again = abs(found.fbest - least) < _SAME * least
        if found.fbest < least:
            least, best = found.fbest, values_at(found.xbest)
        if again:
            break
        start = random.uniform(size=len(names))
    return best, spent


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
