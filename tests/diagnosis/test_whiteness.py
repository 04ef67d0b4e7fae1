"""The cumulative periodogram: silent on noise, loud on a tone, with the memory of the filter known."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.diagnosis.whiteness import cumulative_periodogram

N = 800
SEEDS = 400


def p_values(make: object, covariance: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(4)
    return np.array(
        [cumulative_periodogram("time", make(rng), covariance).p_value for _ in range(SEEDS)]  # type: ignore[operator]
    )


def test_noise_is_rejected_as_often_as_it_says() -> None:
    rejected = np.mean(p_values(lambda rng: rng.normal(size=N), np.ones(1)) < 0.05)
    assert 0.02 <= rejected <= 0.08  # 400 draws: a standard error of 1.1 %


def test_the_memory_of_a_filter_is_not_structure() -> None:
    taps = np.array([0.3, 0.7, 0.3])
    covariance = np.correlate(taps, taps, "full")[2:]
    smoothed = p_values(lambda rng: np.convolve(rng.normal(size=N + 2), taps, "valid"), covariance)
    assert 0.02 <= np.mean(smoothed < 0.05) <= 0.08
    taken_for_white = p_values(lambda rng: np.convolve(rng.normal(size=N + 2), taps, "valid"), np.ones(1))
    assert np.mean(taken_for_white < 0.05) > 0.9


@pytest.mark.parametrize("cycles", [2.5, 40.0])
def test_a_tone_as_strong_as_half_the_noise_is_seen(cycles: float) -> None:
    tone = 0.5 * np.sqrt(2.0) * np.sin(2.0 * np.pi * cycles * np.arange(N) / N)
    assert np.mean(p_values(lambda rng: rng.normal(size=N) + tone, np.ones(1)) < 1e-3) > 0.95
