"""The gravity of an arm beside a spring whose shape nobody knows."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from idtool import Log
from idtool.diagnosis.candidates import best_start, try_effect
from idtool.diagnosis.remainder import Remainder, remainder
from idtool.diagnosis.residual import test_residual as tests_of_residual
from idtool.diagnosis.springs import allowing_for_springs
from idtool.effects import registry
from idtool.fit.joint import JointFit
from idtool.fit.results import gravity_parameters
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from tests.diagnosis.conftest import swings

GRAVITY, BENDS = 0.8, 0.25


def fitted(path: Path, bends: float) -> tuple[JointFit, Remainder | None]:
    """An arm with a cable that is soon stretched, or with one that is a straight line, fitted with a straight
    one."""
    frame = swings(
        lambda t, q, w: (
            0.05 * np.sign(w) + 0.02 * w + GRAVITY * np.sin(q) + 0.1 * (q - 0.3) + bends * np.tanh(4.0 * q)
        )
    )
    frame["torque_nm"] += 0.002 * np.random.default_rng(0).normal(size=len(frame))
    frame.to_csv(path / "log.csv", index=False)
    fit = base_of_rows(record([Log.read(path / "log.csv")]), "coulomb", "arm").fits[0]
    spring = registry.get("position_stiffness")
    fit = try_effect(fit, spring, best_start(fit, spring), far=True).fit
    return fit, remainder(fit, tests_of_residual(fit, 0.0), ())


def test_intervals_hold_what_a_bent_spring_took(tmp_path: Path) -> None:
    fit, left = fitted(tmp_path, BENDS)
    assert left is not None
    before, (wider, sentence) = gravity_parameters(fit)["sin"], allowing_for_springs(fit, left)
    assert before.ci95 is not None
    assert not before.ci95[0] < GRAVITY < before.ci95[1]
    after = gravity_parameters(wider)["sin"]
    assert after.ci95 is not None
    assert after.ci95[0] < GRAVITY < after.ci95[1]
    assert "by their sum alone" in str(sentence)


def test_a_straight_spring_that_leaves_noise_is_believed(tmp_path: Path) -> None:
    fit, left = fitted(tmp_path, 0.0)
    assert left is None
    assert allowing_for_springs(fit, left) == (fit, None)
    sin = gravity_parameters(fit)["sin"]
    assert sin.stderr is not None
    assert abs(sin.value - GRAVITY) < 3.0 * sin.stderr
