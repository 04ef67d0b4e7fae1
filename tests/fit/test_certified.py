"""Sessions with known truth and known bounds: value, standard error, and the same answer from any start.

The bounds are Cramer-Rao bounds (`studies.accuracy.cramer_rao`) of the current's noise, the motion known
exactly: standard deviations in the fit's coordinates (the first three and the stiffness as logarithms).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from idtool.fit.choose import first_fit, first_fits
from idtool.fit.joint import JointFit, refit, solve
from idtool.fit.model import JointModel
from idtool.fit.search import OPTIMIZERS
from idtool.signals import record
from testbench.plants import Plant, record_session
from testbench.truth import NAMES, SPEC, truth_of

PAPER = Plant(0.070, 0.030, 0.090, 0.155, 0.051, 0.297, 0.006, 0.2295, 0.4457)
SOFT = Plant(0.093, 0.117, 0.045, 0.200, 0.175, 0.214, 0.0105, 0.18, 0.57)
STIFF = Plant(0.080, 0.115, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)
STEEP = Plant(0.060, 0.095, 0.060, 0.180, 2.0, 0.15, 0.005, 0.12, 0.35)
RISING = Plant(0.130, 0.085, 0.110, 0.100, 1.0, 0.12, 0.013, 0.28, 0.32)


@dataclass(frozen=True)
class Problem:
    """`bounds` belong to `NAMES`: coulomb, static, Stribeck velocity, viscous, bristle stiffness and
    damping, gravity base and per payload, inertia."""

    plant: Plant
    sensors: str
    seed: int
    bounds: tuple[float, ...]


PROBLEMS = {
    "paper, laboratory": Problem(
        PAPER,
        "lab",
        1,
        (0.00248, 0.0104, 0.00474, 0.000697, 0.00221, 0.000691, 8.93e-5, 0.0001, 4.68e-5),
    ),
    "paper, servo's own sensors": Problem(
        PAPER,
        "dynamixel",
        2,
        (0.00346, 0.0145, 0.00662, 0.000973, 0.00308, 0.000965, 0.000125, 0.00014, 6.53e-5),
    ),
    "stiff bristle, falling curve": Problem(
        STIFF,
        "lab",
        3,
        (0.000752, 0.00135, 0.0034, 0.000205, 0.00288, 0.00173, 6.35e-5, 7.2e-5, 5.43e-5),
    ),
    "soft bristle, narrow Stribeck peak": Problem(
        SOFT,
        "lab",
        4,
        (0.001, 0.0241, 0.0484, 0.000316, 0.00144, 0.00037, 9.66e-5, 0.000105, 4.8e-5),
    ),
    "steep fall, servo's own sensors": Problem(
        STEEP,
        "dynamixel",
        5,
        (0.0013, 0.00589, 0.00902, 0.000276, 0.00525, 0.00114, 8.94e-5, 0.000101, 8.02e-5),
    ),
    "rising curve, medium bristle": Problem(
        RISING,
        "lab",
        6,
        (0.000711, 0.00266, 0.00389, 0.000261, 0.00123, 0.000447, 6.93e-5, 7.73e-5, 5.27e-5),
    ),
}
#: Every problem; one of them in each run of the tests (tests/verbs/test_recovery.py has the paper's axis).
_OFTEN = "stiff bristle, falling curve"
NAMES_OF_PROBLEMS = [pytest.param(name, marks=[pytest.mark.long] * (name != _OFTEN)) for name in PROBLEMS]
#: Factors on friction levels, Stribeck velocity, bristle stiffness: starts that a stranger might try.
STARTS = ((1.5, 1.5, 0.7, 1.4), (0.7, 1.0, 1.5, 0.7))


@cache
def fitted(name: str) -> JointFit:
    problem = PROBLEMS[name]
    recording = record(record_session(problem.plant, problem.sensors, problem.seed))
    found = first_fits(recording, SPEC)[-1]
    return refit(found, JointModel.build(recording, replace(SPEC, soft=found.model.spec.soft)))


@pytest.mark.parametrize("name", NAMES_OF_PROBLEMS)
def test_value(name: str) -> None:
    fit, problem = fitted(name), PROBLEMS[name]
    assert fit.model.names == NAMES
    off = (fit.x - truth_of(fit.model, problem.plant)) / np.array(problem.bounds)
    # nine parameters in six sessions: of 54 normal numbers hardly one is above 3.3
    assert np.all(np.abs(off) < 3.3), dict(zip(NAMES, off.round(2), strict=True))
    assert fit.rmse == pytest.approx(fit.model.filtered_noise, rel=0.05)


@pytest.mark.parametrize("name", NAMES_OF_PROBLEMS)
def test_standard_error(name: str) -> None:
    fit, problem = fitted(name), PROBLEMS[name]
    ratio = np.sqrt(np.diag(fit.covariance)) / np.array(problem.bounds)
    # a standard error from some dozens of blocks is itself uncertain by a sixth or so
    assert np.all((ratio > 0.65) & (ratio < 1.6)), dict(zip(NAMES, ratio.round(2), strict=True))
    assert 0.85 < np.median(ratio) < 1.2


@pytest.mark.parametrize("name", NAMES_OF_PROBLEMS)
def test_same_answer_as_from_the_truth_and_from_other_starts(name: str) -> None:
    fit, problem = fitted(name), PROBLEMS[name]
    best = solve(fit.model, truth_of(fit.model, problem.plant))
    assert fit.sse <= best.sse * (1.0 + 1e-6)
    for coulomb, static, speed, stiffness in STARTS:
        start = dict(fit.values)
        start["coulomb"] *= coulomb
        start["static"] *= static
        start["stribeck_velocity"] *= speed
        start["bristle_stiffness"] *= stiffness
        other = solve(fit.model, fit.model.coordinates(start))
        assert other.sse == pytest.approx(fit.sse, rel=1e-6)
        np.testing.assert_allclose(other.x, fit.x, atol=0.02 * np.array(problem.bounds).max(), rtol=0.01)


@pytest.mark.parametrize("optimizer", OPTIMIZERS)
def test_every_optimizer_ends_in_the_same_minimum(optimizer: str) -> None:
    fit = fitted(_OFTEN)
    other = refit(first_fit(fit.model.recording, SPEC, optimizer=optimizer, seed=5), fit.model)
    assert other.sse == pytest.approx(fit.sse, rel=1e-6)
