"""The spectrum that decides how wide the low-pass is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from idtool.model.motion import Motion
from idtool.signals import lowpass


@pytest.mark.parametrize(("rows", "segment"), [(400, 64), (77, 77), (300, 65)])
def test_the_power_density_is_scipy_s(rows: int, segment: int) -> None:
    values = np.random.default_rng(4).normal(size=rows) + 0.02 * np.arange(rows)
    frequency, pieces = lowpass.power_densities(values, 200.0, segment)
    power = pieces.mean(axis=0)
    theirs = signal.welch(values, 200.0, nperseg=segment, detrend="linear")
    np.testing.assert_allclose(frequency, theirs[0], rtol=1e-12)
    np.testing.assert_allclose(power, theirs[1], rtol=1e-9)


def motion(*steps: tuple[float, int]) -> Motion:
    """A trial for each (step, rows)."""
    time = np.concatenate([step * np.arange(rows) for step, rows in steps])
    trial = np.repeat(np.arange(len(steps)), [rows for _, rows in steps])
    return Motion(time, trial, 0.0 * time, 0.0 * time, 0.0 * time)


def bandwidth(*waves: tuple[float, float], noise: float = 0.0) -> float:
    """Of waves of (frequency, amplitude) at 200 Hz."""
    at = motion((0.005, 8000))
    torque = sum(size * np.sin(2.0 * np.pi * hertz * at.time) for hertz, size in waves)
    torque = torque + noise * np.random.default_rng(0).standard_normal(len(at))
    return lowpass.bandwidth_and_noise(np.asarray(torque), at, 200.0)[0]


def test_half_as_much_again_passes_as_stands_out_of_noise() -> None:
    assert bandwidth((20.0, 1.0), noise=0.1) == pytest.approx(30.0, abs=1.0)


def test_ten_hertz_always_pass() -> None:
    assert bandwidth((0.5, 1.0), noise=0.1) == 10.0


@pytest.mark.parametrize(("share", "expected"), [(0.013, 60.0), (0.007, 10.0)])
def test_a_hundredth_of_the_torque_is_not_worth_following(share: float, expected: float) -> None:
    """A recording that was filtered before has no floor of noise that would say so."""
    assert bandwidth((5.0, 1.0), (40.0, share)) == pytest.approx(expected, abs=1.5)


@pytest.mark.parametrize(("slow", "expected"), [(192.0, 200.0), (188.0, 188.0), (100.0, 100.0), (20.0, 40.0)])
def test_the_filter_is_designed_for_the_slowest_log_within_reason(slow: float, expected: float) -> None:
    logs = motion((0.005, 1000), (1.0 / slow, 400))
    assert lowpass.common_rate(logs, logs.trial) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("lost", "left"), [((1, 2, 3), 2), ((1, 2, 3, 7), 0)])
def test_six_tenths_of_a_filtered_row_s_weights_must_count(lost: tuple[int, ...], left: int) -> None:
    """Of every second row of nine, with the weights 0.15, 0.5, 0.85, 1, 0.85, 0.5, 0.15 about it."""
    usable = ~np.isin(np.arange(9), (0, 8, *lost))
    rows = lowpass.operator(motion((0.005, 9)), usable, lowpass.Filter(50.0, 100.0, 7))
    np.testing.assert_allclose(rows @ np.ones(9), np.ones(left))
