"""Intervals hold the truth as often as they say, whatever the residual remembers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from idtool.fit.covariance import correlation_rows, uncertainty

SESSIONS, TRIALS, ROWS = 400, 12, 120


def remembering(rng: np.random.Generator, memory: float, shape: tuple[int, ...]) -> np.ndarray:
    """First-order autoregressive noise of variance 1 along the last axis, settled."""
    white = rng.normal(size=(*shape[:-1], shape[-1] + 100)) * np.sqrt(1.0 - memory**2)
    return signal.lfilter([1.0], [1.0, -memory], white)[..., 100:]


def regressors(rng: np.random.Generator, kind: str) -> np.ndarray:
    """Shape (TRIALS * ROWS, 2): "spread" is informative everywhere, "few" in a few stretches only."""
    smooth = remembering(rng, 0.9, (2, TRIALS, ROWS))
    if kind == "few":
        stretch = np.zeros((TRIALS, ROWS))
        stretch[:4, 60:100] = 1.0
        smooth[1] *= stretch
    return smooth.reshape(2, -1).T


@pytest.mark.parametrize("memory", [0.0, pytest.param(0.5, marks=pytest.mark.long), 0.85])
@pytest.mark.parametrize("kind", ["spread", "few"])
def test_coverage(memory: float, kind: str) -> None:
    rng = np.random.default_rng(round(100 * memory) + len(kind))
    trial = np.repeat(np.arange(TRIALS), ROWS)
    truth = np.array([1.0, -2.0])
    held, ratios = np.zeros((SESSIONS, 2)), np.zeros((SESSIONS, 2))
    for session in range(SESSIONS):
        columns = regressors(rng, kind)
        target = columns @ truth + remembering(rng, memory, (TRIALS, ROWS)).ravel()
        found = np.linalg.lstsq(columns, target, rcond=None)[0]
        known = uncertainty(columns, target - columns @ found, trial)
        spread = np.sqrt(np.diag(known.covariance))
        held[session] = np.abs(found - truth) <= known.quantile * spread
        ratios[session] = (found - truth) / spread
    # 400 sessions: three standard errors of a share of 0.95 are 0.033
    assert np.all(np.abs(held.mean(axis=0) - 0.95) < 0.033), held.mean(axis=0)
    assert np.all(np.abs(ratios.mean(axis=0)) < 0.2)


def test_a_parameter_that_rests_on_few_stretches_has_few_degrees_of_freedom() -> None:
    rng = np.random.default_rng(3)
    trial = np.repeat(np.arange(TRIALS), ROWS)
    columns = regressors(rng, "few")
    known = uncertainty(columns, rng.normal(size=len(columns)), trial)
    assert known.degrees[1] < 0.3 * known.degrees[0]
    assert known.quantile[1] > known.quantile[0] > 1.95


def test_never_below_white_noise() -> None:
    rng = np.random.default_rng(0)
    columns = rng.normal(size=(60, 2))
    residual = rng.normal(size=60)
    known = uncertainty(columns, residual, np.zeros(60, dtype=np.intp))
    white = residual @ residual / 58 * np.linalg.inv(columns.T @ columns)
    assert np.all(np.diag(known.covariance) >= np.diag(white) * (1.0 - 1e-9))


@pytest.mark.parametrize(("memory", "rows"), [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)])
def test_correlation_time(memory: float, rows: float) -> None:
    noise = remembering(np.random.default_rng(1), memory, (40, 2000))
    found = correlation_rows(noise.ravel(), np.repeat(np.arange(40), 2000))
    assert found == pytest.approx(rows, rel=0.15)
