"""Accuracy and honesty of the estimator over many simulated sessions.

Every session: a random axis, the packaged gravity, sweep and sine runs, one joint fit that knows the
model's form and nothing else. Compared with the truth and with the Cramer-Rao bound, which is computed
from the NOISE-FREE motion and the current's noise alone, so that nothing that knows the motion only
through sensors can reach it altogether.

python -m studies.accuracy [--sessions N] [--out docs/accuracy.md]      (make study-accuracy)
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import repeat
from pathlib import Path

import click
import numpy as np

from idtool.fit.choose import first_fit
from idtool.fit.joint import JointFit, refit, solve
from idtool.fit.model import JointModel
from idtool.fit.results import dynamic_parameters, gravity_parameters, static_parameters
from idtool.model.torque import linearise
from idtool.rig.sensors import SENSORS
from idtool.signals import Recording, record
from pages import markdown
from testbench.plants import TORQUE_CONSTANT, Plant, random_plant, record_session
from testbench.truth import NAMES, SPEC, truth_of

_PAGE = "docs/accuracy.md"


@dataclass(frozen=True)
class Grade:
    """Sensors of the rig, whether the fit sees the position, and the share of the sessions to run."""

    sensors: str
    position: bool = True
    share: float = 1.0


GRADES = {
    "Laboratory sensors": Grade("lab"),
    "DYNAMIXEL sensors": Grade("dynamixel"),
    "DYNAMIXEL sensors, position not used": Grade("dynamixel", position=False, share=0.25),
}


@dataclass(frozen=True)
class Outcome:
    """One session, in the fit's coordinates.

    Attributes:
        truth, estimate, stderr, bound: per parameter of `NAMES`, shape (9,).
        quantile: half widths of the 95 % intervals in standard errors, shape (9,).
        identified: whether the fit says that the data determine the parameter, shape (9,).
        missed: cost over that of a fit started from the truth, less 1.
    """

    truth: np.ndarray
    estimate: np.ndarray
    stderr: np.ndarray
    bound: np.ndarray
    quantile: np.ndarray
    identified: np.ndarray
    missed: float


def one_session(seed: int, grade: Grade) -> Outcome:
    """Draw, record, fit, compare."""
    plant = random_plant(np.random.default_rng(seed))
    logs = record_session(plant, grade.sensors, seed)
    if not grade.position:
        logs = [replace(log, rows=log.frame.drop(columns="position_rad")) for log in logs]
    recording = record(logs)
    fit = refit(first_fit(recording, SPEC), JointModel.build(recording, SPEC))
    informed = solve(fit.model, truth_of(fit.model, plant))
    quiet = record(record_session(plant, "ideal", seed))
    return Outcome(
        truth_of(fit.model, plant),
        fit.x,
        np.sqrt(np.diag(fit.covariance)),
        cramer_rao(quiet, plant, grade.sensors),
        fit.quantile,
        _identified(fit),
        fit.sse / informed.sse - 1.0,
    )


def cramer_rao(recording: Recording, plant: Plant, sensors: str) -> np.ndarray:
    """Standard deviations that no unbiased estimate can fall below, with the motion known exactly.

    The start deflection of each trial is an unknown of its own.
    """
    model = JointModel.build(recording, SPEC)
    x = truth_of(model, plant)
    prediction, derivatives = linearise(
        recording.motion,
        model.friction(x),
        model.contribution(x),
        np.zeros(recording.trials),
        model.directions(x),
    )
    jacobian = np.column_stack(list(derivatives))
    trial, start = recording.motion.trial, prediction.start_column
    norm = np.bincount(trial, start**2)
    share = np.column_stack([np.bincount(trial, start * column) / norm for column in jacobian.T])
    free = jacobian - start[:, None] * share[trial]
    grade = SENSORS[sensors]
    noise = TORQUE_CONSTANT * math.sqrt(grade.current_noise**2 + grade.current_step**2 / 12.0)
    return noise * np.sqrt(np.diag(np.linalg.inv(free.T @ free)))


def _identified(fit: JointFit) -> np.ndarray:
    table = {**static_parameters(fit), **dynamic_parameters(fit)}
    table |= {f"gravity.{name}": value for name, value in gravity_parameters(fit).items()}
    return np.array([table[name].identified if name in table else True for name in NAMES])


def table(outcomes: list[Outcome]) -> list[str]:
    """One row a parameter, over the sessions whose fit says that it is determined."""
    rows = []
    for j, name in enumerate(NAMES):
        kept = [o for o in outcomes if o.identified[j]]
        error = np.array([o.estimate[j] - o.truth[j] for o in kept])
        bound = np.array([o.bound[j] for o in kept])
        spread = np.array([o.stderr[j] for o in kept])
        reach = np.array([o.quantile[j] for o in kept]) * spread
        rows.append(
            (
                name.rpartition(".")[2].replace("_", " "),
                f"{len(kept)} of {len(outcomes)}",
                f"{_root_mean(error / bound):.2f}",
                f"{_root_mean(error / spread):.2f}",
                f"{np.mean(error / spread):+.2f}",
                f"{100 * np.mean(np.abs(error) <= reach):.1f} %",
            )
        )
    of = ("error / bound", "error / standard error", "bias / standard error", "in 95 % interval")
    return markdown.table(("parameter", "determined in", *of), rows)


def _root_mean(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def section(title: str, outcomes: list[Outcome]) -> list[str]:
    """The part of the page on one grade of sensors."""
    missed = sum(o.missed > 1e-6 for o in outcomes)
    return [
        f"## {title}: {len(outcomes)} sessions",
        "",
        *table(outcomes),
        "",
        "The global search ended in another minimum than a fit started from the truth in "
        f"{missed} of {len(outcomes)} sessions.",
        "",
    ]


@click.command()
@click.option("--sessions", default=200, show_default=True)
@markdown.out_option(_PAGE)
def main(sessions: int, out: Path) -> None:
    """Run the study and write its part of the page."""
    lines: list[str] = []
    for title, grade in GRADES.items():
        seeds = range(max(1, round(grade.share * sessions)))
        with ProcessPoolExecutor(os.cpu_count()) as pool:
            made = section(title, list(pool.map(one_session, seeds, repeat(grade))))
        click.echo("\n".join(made))
        lines += made
        markdown.write_made(_PAGE, {"estimates": lines}, "study-accuracy", out)


if __name__ == "__main__":
    main()
