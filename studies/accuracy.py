"""Accuracy and honesty of the estimator over many simulated sessions.

Every session: a random axis, the packaged gravity, sweep and sine runs, one joint fit that knows the
model's form and nothing else. Compared with the truth and with the Cramer-Rao bound, which is computed
from the NOISE-FREE motion and the current's noise alone, so that nothing that knows the motion only
through sensors can reach it altogether.

python -m studies.accuracy [--sessions N] [--out docs/accuracy.md]
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from idtool.effects import registry
from idtool.fit.choose import first_fit
from idtool.fit.joint import JointFit, refit, solve
from idtool.fit.model import JointModel, Spec
from idtool.fit.results import dynamic_parameters, gravity_parameters, static_parameters
from idtool.model.torque import linearise
from idtool.rig.sensors import SENSORS
from idtool.signals import Recording, record
from studies.plants import TORQUE_CONSTANT, Plant, random_plant, record_session

SPEC = Spec("lugre", "slide", ("base", "per_payload"), (registry.get("inertia"),))
NAMES = (
    "coulomb",
    "static",
    "stribeck_velocity",
    "viscous",
    "bristle_stiffness",
    "bristle_damping",
    "gravity.base",
    "gravity.per_payload",
    "inertia.inertia",
)


@dataclass(frozen=True)
class Outcome:
    """One session: per parameter of `NAMES`, in the fit's coordinates.

    Attributes:
        truth, estimate, stderr, bound: shape (9,).
        quantile: half widths of the 95 % intervals in standard errors, shape (9,).
        identified: whether the fit says that the data determine the parameter.
    """

    seed: int
    plant: Plant
    truth: np.ndarray
    estimate: np.ndarray
    stderr: np.ndarray
    bound: np.ndarray
    quantile: np.ndarray
    identified: np.ndarray
    ratio: float
    missed: float


def one_session(seed: int, sensors: str) -> Outcome:
    """Draw, record, fit, compare."""
    plant = random_plant(np.random.default_rng(seed))
    recording = record(record_session(plant, sensors, seed))
    fit = refit(first_fit(recording, SPEC), JointModel.build(recording, SPEC))
    informed = solve(fit.model, truth_of(fit.model, plant))
    quiet = record(record_session(plant, "ideal", seed))
    return Outcome(
        seed,
        plant,
        truth_of(fit.model, plant),
        fit.x,
        np.sqrt(np.diag(fit.covariance)),
        cramer_rao(quiet, plant, sensors),
        fit.quantile,
        _identified(fit),
        fit.rmse / fit.model.filtered_noise,
        fit.sse / informed.sse - 1.0,
    )


def truth_of(model: JointModel, plant: Plant) -> np.ndarray:
    values = {name: getattr(plant, name.partition(".")[2] or name) for name in NAMES}
    return np.array([math.log(values[n]) if n in NAMES[:3] or n == NAMES[4] else values[n] for n in NAMES])


def cramer_rao(recording: Recording, plant: Plant, sensors: str) -> np.ndarray:
    """Standard deviations that no unbiased estimate can fall below, with the motion known exactly.

    The start deflection of each trial is an unknown of its own.
    """
    model = JointModel.build(recording, SPEC)
    x = truth_of(model, plant)
    prediction, jacobian = linearise(
        recording.motion,
        model.friction(x),
        model.contribution(x),
        np.zeros(recording.trials),
        model.directions(x),
    )
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


def _one(arguments: tuple[int, str]) -> Outcome:
    return one_session(*arguments)


def study(sessions: int, sensors: str, first: int = 0) -> list[Outcome]:
    """All sessions on the cores there are."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(_one, [(first + s, sensors) for s in range(sessions)]))


def summary(outcomes: list[Outcome]) -> str:
    lines = []
    for j, name in enumerate(NAMES):
        ok = np.array([o.identified[j] for o in outcomes])
        err = np.array([o.estimate[j] - o.truth[j] for o in outcomes])[ok]
        sd = np.array([o.stderr[j] for o in outcomes])[ok]
        crb = np.array([o.bound[j] for o in outcomes])[ok]
        q = np.array([o.quantile[j] for o in outcomes])[ok]
        lines.append(
            f"{name:20s} n {ok.sum():4d} rms/crb {np.sqrt(np.mean((err / crb) ** 2)):7.2f} "
            f"median|e|/crb {np.median(np.abs(err / crb)) / 0.6745:6.2f} bias/crb {np.mean(err / crb):6.2f} "
            f"bias/se {np.mean(err / sd):6.2f} se/crb {np.median(sd / crb):6.2f} "
            f"cover {np.mean(np.abs(err) <= q * sd) * 100:5.1f} %"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    import sys

    sensors = sys.argv[1]
    outcomes = study(int(sys.argv[2]), sensors)
    print(summary(outcomes))
    print("rms/noise", np.median([o.ratio for o in outcomes]), max(o.ratio for o in outcomes))
    print("missed", [(o.seed, round(o.missed, 4)) for o in outcomes if abs(o.missed) > 1e-5])
    import pickle

    pickle.dump(outcomes, open(f"/tmp/acc_{sensors}.pkl", "wb"))
