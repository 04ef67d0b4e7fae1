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


def at_few_places(seed: int) -> Array:
    """A column that acts on ten rows after three moments."""
    rng = np.random.default_rng(seed)
    column = np.zeros(ROWS)
    for begin in rng.integers(0, ROWS - 10, 3):
        column[begin : begin + 10] += rng.standard_normal() * np.exp(-np.arange(10) / 3.0)
    return column


def test_what_acts_at_few_places_passes_no_more_often_by_chance() -> None:
    found = np.array([judged(noise(seed, 0.5), at_few_places(seed + 10_000)) for seed in range(1000)])
    assert np.mean(found < 0.05) < 0.08
    assert np.mean(found < 1e-3) < 0.004  # it was 0.05 when only the blocks told their own variance


def test_what_acts_at_few_places_shows_where_it_is_large() -> None:
    found = []
    for seed in range(50):
        column = at_few_places(seed + 10_000)
        found.append(judged(noise(seed, 0.5) + 12.0 * column / np.abs(column).max(), column))
    assert np.mean(np.array(found) < 1e-3) > 0.9


def test_a_slow_remainder_hides_no_fast_effect() -> None:
    fast = np.sin(0.7 * np.arange(ROWS))
    found = [judged(5.0 * noise(seed, 0.97) + 3.0 * fast, fast) for seed in range(50)]
    assert np.mean(np.array(found) < 1e-3) > 0.95


def test_a_column_that_is_known_says_nothing() -> None:
    residual, known = noise(3, 0.0), np.full((ROWS, 1), 1.0 / np.sqrt(ROWS))
    assert p_value(residual, TRIAL, residual, known, np.ones((ROWS, 1))) == 1.0
