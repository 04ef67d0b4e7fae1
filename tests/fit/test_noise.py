"""Evidence under noise with memory: how often chance passes, and what a slow remainder does not hide."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from idtool.fit.noise import p_value
from idtool.model.motion import Array

ROWS, TRIALS = 1200, 6
TRIAL = np.repeat(np.arange(TRIALS), ROWS // TRIALS)


def judged(residual: Array, column: Array) -> float:
    """P-value of one column, a constant being known."""
    known = np.full((ROWS, 1), 1.0 / np.sqrt(ROWS))
    free = column - column.mean()
    left = residual - residual.mean()
    left = left - free * (free @ left) / (free @ free)
    return p_value(left, TRIAL, residual, known, column[:, None])


def noise(seed: int, memory: float) -> Array:
    """Autoregressive noise, independent from trial to trial."""
    drawn = np.random.default_rng(seed).standard_normal((TRIALS, ROWS // TRIALS + 100))
    return np.asarray(signal.lfilter([1.0], [1.0, -memory], drawn, axis=1)[:, 100:]).ravel()


@pytest.mark.parametrize("memory", [0.0, 0.9])
@pytest.mark.parametrize("slow", [False, True], ids=["fast column", "slow column"])
def test_chance_passes_as_often_as_it_says(memory: float, slow: bool) -> None:
    column = noise(10_000, 0.95) if slow else np.sin(0.7 * np.arange(ROWS))
    found = np.array([judged(noise(seed, memory), column) for seed in range(400)])
    assert 0.02 < np.mean(found < 0.05) < 0.09  # 0.05 +- 3.6 standard errors


def test_a_slow_remainder_hides_no_fast_effect() -> None:
    fast = np.sin(0.7 * np.arange(ROWS))
    found = [judged(5.0 * noise(seed, 0.97) + 3.0 * fast, fast) for seed in range(50)]
    assert np.mean(np.array(found) < 1e-3) > 0.95


def test_a_column_that_is_known_says_nothing() -> None:
    residual, known = noise(3, 0.0), np.full((ROWS, 1), 1.0 / np.sqrt(ROWS))
    assert p_value(residual, TRIAL, residual, known, np.ones((ROWS, 1))) == 1.0
