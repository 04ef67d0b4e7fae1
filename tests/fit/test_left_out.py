"""What a fit would leave of a trial that it had not seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.fit.joint import JointFit
from idtool.fit.left_out import clearly_less, prediction_errors, predicts_better
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows

COLUMNS = 4


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> JointFit:
    """Of six trials; the tests put numbers of their own into it."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(400)
    trials = []
    for trial in range(6):
        w = (0.5 + 0.2 * trial) * np.sin(t)
        torque = np.sign(w) + 0.2 * w + 0.01 * rng.normal(size=len(t))
        position = (0.5 + 0.2 * trial) * -np.cos(t)
        frame = {"trial": trial, "time_s": t + 5.0 * trial, "position_rad": position, "torque_nm": torque}
        trials.append(pd.DataFrame(frame))
    log = Path(tmp_path_factory.mktemp("log")) / "log.csv"
    pd.concat(trials).to_csv(log, index=False)
    found = base_of_rows(record([Log.read(log)]), "coulomb", "none").fits[0]
    return found


def linear(fit: JointFit, columns: np.ndarray, target: np.ndarray) -> JointFit:
    """The least-squares fit of columns to a target in the place of a fit's numbers."""
    names = len(fit.model.names)
    padded = np.zeros((len(target) + len(fit.penalty), names))
    padded[: len(target), : columns.shape[1]] = columns
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return numbers(fit, left, padded)


def numbers(fit: JointFit, residual: np.ndarray, jacobian: np.ndarray) -> JointFit:
    """The fit with a residual and a Jacobian of the test's own."""
    own = replace(fit, residual=residual, penalty=np.zeros(len(fit.penalty)))
    vars(own)["jacobian"] = jacobian  # where a fit keeps what it has computed
    return own


def test_it_is_what_refitting_without_each_trial_leaves(fit: JointFit) -> None:
    rng = np.random.default_rng(1)
    size = min(COLUMNS, int(fit.free.sum()))
    assert fit.free[:size].all()
    columns = rng.normal(size=(len(fit.residual), size))
    target = rng.normal(size=len(fit.residual))
    fold = fit.model.recording.filtered_fold
    refitted = []
    for left_out in np.unique(fold):
        own = fold == left_out
        found = np.linalg.lstsq(columns[~own], target[~own], rcond=None)[0]
        refitted.append(np.sum((target[own] - columns[own] @ found) ** 2))
    np.testing.assert_allclose(prediction_errors(linear(fit, columns, target)), refitted, rtol=1e-9)


def test_a_fit_that_was_cut_short_is_judged_by_where_it_was_going(fit: JointFit) -> None:
    rng = np.random.default_rng(2)
    columns = rng.normal(size=(len(fit.residual), 2))
    ended = linear(fit, columns, rng.normal(size=len(fit.residual)))
    cut = numbers(ended, ended.residual + 0.3 * columns[:, 0], ended.jacobian)
    np.testing.assert_allclose(prediction_errors(cut), prediction_errors(ended), rtol=1e-9)


def test_a_column_that_one_trial_alone_asks_for_does_not_predict(fit: JointFit) -> None:
    """It lowers the error of the fit more than its number costs, whatever the memory of the rows."""
    rng = np.random.default_rng(3)
    fold = fit.model.recording.filtered_fold
    level = rng.normal(size=6)[np.searchsorted(np.unique(fold), fold)]  # drifts from trial to trial
    column = np.cos(np.linspace(0.0, 1.0, len(fold)) + fold)
    target = level + 0.1 * rng.normal(size=len(fold))
    with_it = linear(fit, np.column_stack([column]), target)
    without = numbers(fit, target, np.zeros_like(with_it.jacobian))
    assert with_it.sse < 0.97 * without.sse
    assert not predicts_better(with_it, without)


def test_less_by_chance_is_not_less() -> None:
    assert clearly_less(np.array([1.0, 1.0, 1.0, 1.0]), np.array([2.0, 1.9, 2.1, 2.0]))
    assert not clearly_less(np.array([1.0, 1.0, 1.0, 1.0]), np.array([5.0, 0.2, 0.1, 0.1]))
    assert not clearly_less(np.ones(3), np.ones(3))
