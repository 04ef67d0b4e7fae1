"""The floor under a residual: what does not come again at the same place, speed and acceleration."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from idtool.diagnosis.remainder import limit
from idtool.diagnosis.repeatability import repeatability
from idtool.model.motion import Array, Motion

ROWS, STEP = 4000, 0.01


def fit(residual: Array, period: float) -> Any:
    """As much of a fit as is asked for: a sine motion, its rows and a residual."""
    time = np.arange(ROWS) * STEP
    omega = 2.0 * np.pi / period
    trial = np.zeros(ROWS, dtype=np.intp)
    motion = Motion(
        time, trial, np.sin(omega * time), omega * np.cos(omega * time), -(omega**2) * np.sin(omega * time)
    )
    recording = SimpleNamespace(motion=motion, row=np.arange(ROWS), filtered_trial=trial)
    return SimpleNamespace(model=SimpleNamespace(recording=recording), residual=residual)


def test_it_is_the_noise_beside_any_structure_that_comes_again() -> None:
    noise = 0.01 * np.random.default_rng(0).standard_normal(ROWS)
    structure = np.sin(2.0 * np.pi / 4.0 * np.arange(ROWS) * STEP)  # repeats with the motion
    assert repeatability(fit(noise + structure, 4.0)) == pytest.approx(0.01, rel=0.15)


def test_what_came_once_is_no_noise() -> None:
    """A cable that snags for a moment made itself the floor."""
    noise = 0.01 * np.random.default_rng(0).standard_normal(ROWS)
    noise[2000:2150] += 0.3
    assert repeatability(fit(noise, 4.0)) == pytest.approx(0.01, rel=0.2)


def test_a_motion_that_never_comes_again_tells_nothing() -> None:
    assert repeatability(fit(np.zeros(ROWS), 10.0 * ROWS * STEP)) is None


def test_what_is_large_and_never_comes_again_is_no_noise() -> None:
    hands = 0.3 * np.sin(2.0 * np.pi / 7.3 * np.arange(ROWS) * STEP)  # beats against the motion
    one = fit(hands, 4.0)
    one.model.filtered_noise, one.model.friction_sizes = 0.01, (1.0, 2.0)
    assert repeatability(one) > 0.1
    assert limit(one) == pytest.approx(0.05)
