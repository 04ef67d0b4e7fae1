"""The smoother: true motion from coarse readings, without lag."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from idtool.signals.smoother import TOO_FAST, _lasting, reading_variance, smooth


def truth(rows: int = 3000, period: float = 0.005) -> tuple[np.ndarray, ...]:
    t = period * np.arange(rows)
    f = 2 * np.pi * np.array([0.3, 0.9])
    q = 0.3 * np.sin(f[0] * t) + 0.05 * np.sin(f[1] * t)
    w = 0.3 * f[0] * np.cos(f[0] * t) + 0.05 * f[1] * np.cos(f[1] * t)
    a = -0.3 * f[0] ** 2 * np.sin(f[0] * t) - 0.05 * f[1] ** 2 * np.sin(f[1] * t)
    return t, q, w, a


def first_of(rows: int) -> np.ndarray:
    first = np.zeros(rows, dtype=bool)
    first[0] = True
    return first


@pytest.mark.parametrize("readings", ["both", "position", "velocity"])
def test_finds_the_motion_behind_a_servos_coarse_readings(readings: str) -> None:
    t, q, w, a = truth()
    counts, speed_step = 2 * np.pi / 4096, 0.024
    position = np.round(q / counts) * counts if readings != "velocity" else None
    velocity = np.round(w / speed_step) * speed_step if readings != "position" else None
    found = smooth(t, position, velocity, first_of(len(t)))
    inside = slice(100, -100)
    # the velocity reading alone is off by 7 mrad/s rms, differences of the position by 90
    assert np.sqrt(np.mean((found.velocity - w)[inside] ** 2)) < 0.006
    assert np.sqrt(np.mean((found.acceleration - a)[inside] ** 2)) < 0.25
    if readings != "velocity":
        assert np.sqrt(np.mean((found.position - q)[inside] ** 2)) < counts / 4
    assert np.mean(found.surprise > TOO_FAST) < 0.01


def test_lags_nothing() -> None:
    t, q, w, _ = truth()
    rng = np.random.default_rng(0)
    found = smooth(t, np.round(q, 4), np.round(w + 1e-3 * rng.normal(size=len(w)), 4), first_of(len(t)))
    inside = slice(200, -200)
    lags = range(-5, 6)
    errors = [float(np.sum((np.roll(found.velocity, lag) - w)[inside] ** 2)) for lag in lags]
    assert lags[int(np.argmin(errors))] == 0


def test_follows_a_step_and_marks_it() -> None:
    t = 0.005 * np.arange(2000)
    w = np.where(t < 5.0, 0.2, -0.2)
    q = np.cumsum(w) * 0.005
    rng = np.random.default_rng(0)
    found = smooth(t, np.round(q, 4), w + 1e-3 * rng.normal(size=len(w)), first_of(len(t)))
    away = np.abs(t - 5.0) > 0.05
    assert np.max(np.abs(found.velocity - w)[away]) < 0.01


def test_trials_do_not_leak_into_each_other() -> None:
    t, q, w, _ = truth(1500)
    first = np.concatenate([first_of(1500), first_of(1500)])
    two = smooth(np.concatenate([t, t]), np.concatenate([q, -q]), np.concatenate([w, -w]), first)
    assert two.velocity[1500:] == pytest.approx(-two.velocity[:1500], abs=1e-9)


def test_a_reading_that_disagrees_is_doubted_not_the_motion() -> None:
    t, q, w, _ = truth()
    late = np.roll(w, 12)  # a drive that filters its velocity: 60 ms late
    late[:12] = late[12]
    found = smooth(t, np.round(q, 5), np.round(late, 4), first_of(len(t)))
    inside = slice(100, -100)
    assert np.mean(found.surprise > TOO_FAST) < 0.03
    assert np.sqrt(np.mean((found.velocity - w)[inside] ** 2)) < 0.25 * np.sqrt(
        np.mean((late - w)[inside] ** 2)
    )


@pytest.mark.parametrize("size", [0.05, 0.2])
@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_a_single_velocity_that_the_position_denies_is_not_used(size: float, way: float) -> None:
    """50 to 200 times the noise: it would stop the axis, or turn it round, for one row."""
    t, q, w, _ = truth()
    read = w + 1e-3 * np.random.default_rng(0).normal(size=len(w))
    rows = np.array([700, 713, 1500, 2200])
    read[rows] += way * size * np.array([1.0, 0.8, -1.0, 1.2])
    found = smooth(t, np.round(q, 4), np.round(read, 4), first_of(len(t)))
    assert not (found.surprise > TOO_FAST).any()
    assert np.max(np.abs(found.velocity - w)[rows[:, None] + np.arange(-3, 4)]) < 4e-3


def test_a_velocity_that_leaps_for_good_is_motion() -> None:
    """One that the axis starts with, overshoots and keeps is no single reading beside the others."""
    t = 0.005 * np.arange(2000)
    w = np.where(t < 5.0, 0.0, 0.2 + 0.05 * np.exp(-(((t - 5.01) / 0.006) ** 2)))
    q = 0.005 * np.cumsum(w)
    read = w + 1e-3 * np.random.default_rng(0).normal(size=len(w))
    found = smooth(t, np.round(q, 4), np.round(read, 4), first_of(len(t)))
    peak = slice(1000, 1006)
    assert found.velocity[peak] == pytest.approx(w[peak], abs=0.01)


def test_variance_of_a_reading() -> None:
    rng = np.random.default_rng(0)
    _, q, _, _ = truth()
    noisy = q + 3e-4 * rng.normal(size=len(q))
    assert np.sqrt(reading_variance(noisy, first_of(len(q)))) == pytest.approx(3e-4, rel=0.1)


def test_a_slow_counter_is_read_at_its_edges() -> None:
    """A servo's own sensors at 0.03 rad/s: a count lasts ten rows, and the velocity reading is one step."""
    rng = np.random.default_rng(2)
    t = 0.005 * np.arange(4000)
    w = 0.03 + 0.01 * np.sin(2.0 * np.pi * 0.2 * t)
    q = np.cumsum(w) * 0.005
    counts, speed_step = 2 * np.pi / 4096, 0.024
    velocity = np.round((w + 0.3 * speed_step * rng.normal(size=len(t))) / speed_step) * speed_step
    found = smooth(t, np.round(q / counts) * counts, velocity, first_of(len(t)))
    inside = slice(200, -200)
    # averages of the velocity reading alone would be off by 1 mrad/s, since rounding is no white noise
    assert np.sqrt(np.mean((found.velocity - w)[inside] ** 2)) < 4e-4
    assert np.sqrt(np.mean((found.position - q)[inside] ** 2)) < counts / 10


def test_a_steady_stretch_is_averaged_long_and_a_reversal_is_followed() -> None:
    rng = np.random.default_rng(4)
    t = 0.005 * np.arange(6000)
    w = 0.2 * np.clip(50.0 * np.sin(2.0 * np.pi * t / 10.0), -1.0, 1.0)  # trapezoids: ramps of 30 ms
    q = np.cumsum(w) * 0.005
    found = smooth(t, np.round(q, 4), w + 1e-3 * rng.normal(size=len(w)), first_of(len(t)))
    ramp = np.abs(w) < 0.199
    steady = ~np.convolve(ramp, np.ones(401), mode="same").astype(bool)
    assert np.sqrt(np.mean((found.velocity - w)[steady] ** 2)) < 1e-4
    assert np.sqrt(np.mean((found.velocity - w)[ramp] ** 2)) < 0.02 * 0.2


@pytest.mark.parametrize(("grain", "noise"), [(2 * np.pi / 4096, 0.024), (1e-4, 1e-3)])
def test_standing_still_is_no_motion_and_creeping_is(grain: float, noise: float) -> None:
    """A rest of ten seconds, and a creep of two grains a second, which no velocity reading shows."""
    rng = np.random.default_rng(5)
    t = 0.005 * np.arange(6000)
    w = np.where(t < 10.0, 0.3 * np.sin(2.0 * np.pi * 0.2 * t), np.where(t < 20.0, 0.0, 2.0 * grain))
    q = np.cumsum(w) * 0.005
    velocity = np.round(w / noise + 0.3 * rng.normal(size=len(t))) * noise
    found = smooth(t, np.round(q / grain) * grain, velocity, first_of(len(t)))
    resting, creeping = (t > 11.5) & (t < 19.5), (t > 21.0) & (t < 29.0)
    # what a stiff bristle would forget at rest: the way that the noise alone adds up to
    assert np.sum(np.abs(found.velocity[resting])) * 0.005 < 0.1 * grain
    assert np.mean(found.velocity[creeping]) == pytest.approx(2.0 * grain, rel=0.05)


def through_a_drive(velocity: np.ndarray, period: float, time_constant: float) -> np.ndarray:
    """A velocity through a first-order filter, as drives report it."""
    late = np.empty(len(velocity))
    late[0] = velocity[0]
    for k in range(1, len(velocity)):
        late[k] = late[k - 1] + (velocity[k] - late[k - 1]) * period / time_constant
    return late


def test_a_filtered_velocity_is_left_out() -> None:
    """It is not the slope of the position that was counted, however fine its steps."""
    t, q, w, a = truth(period=0.002)
    rng = np.random.default_rng(0)
    position = np.round(q, 5)
    true, late = (v + 1e-3 * rng.normal(size=len(w)) for v in (w, through_a_drive(w, 0.002, 0.03)))
    assert not smooth(t, position, true, first_of(len(t))).contradicted
    found = smooth(t, position, late, first_of(len(t)))
    alone = smooth(t, position, None, first_of(len(t)))
    assert found.contradicted
    assert not alone.contradicted
    np.testing.assert_array_equal(found.acceleration, alone.acceleration)
    np.testing.assert_array_equal(found.surprise, alone.surprise)
    inside = slice(200, -200)
    assert np.sqrt(np.mean((found.acceleration - a)[inside] ** 2)) < 0.1


def test_noise_of_a_velocity_that_was_low_passed_before_it_came() -> None:
    """None of it is near the Nyquist frequency, where third differences look."""
    t, q, w, a = truth(period=0.008)
    rng = np.random.default_rng(0)
    low = signal.butter(2, 10.0, fs=125.0, output="sos")
    noisy = signal.sosfiltfilt(low, w + 2e-3 * rng.normal(size=len(w)))
    found = smooth(t, np.round(q, 6), noisy, first_of(len(t)))
    inside = slice(100, -100)
    # with the noise taken for what third differences show: 0.09 of it
    assert np.sqrt(np.mean((found.acceleration - a)[inside] ** 2)) < 0.02 * np.std(a)


def test_noise_that_lasts_weighs_as_much_as_before_it_was_low_passed() -> None:
    rng = np.random.default_rng(0)
    white = rng.normal(size=6000)
    low = signal.sosfiltfilt(signal.butter(2, 10.0, fs=125.0, output="sos"), white)
    assert _lasting(white) == pytest.approx(1.0, abs=0.1)
    # a low-pass leaves the density of what it lets pass as it was
    assert _lasting(low) * np.var(low) == pytest.approx(1.0, rel=0.25)
