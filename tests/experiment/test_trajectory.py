"""Motions: where they go, that they rest at both ends, and that nothing in them is abrupt."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from idtool.experiment.trajectory import BackAndForth, Sines, excursion

periods = st.sampled_from([0.001, 0.002, 0.005, 0.01])


@given(
    speed=st.floats(0.02, 1.5),
    travel=st.floats(0.05, 5.0),
    acceleration=st.floats(0.05, 20.0),
    repeats=st.integers(1, 3),
    dwell=st.floats(0.0, 1.0),
    period=periods,
)
def test_back_and_forth(
    speed: float, travel: float, acceleration: float, repeats: int, dwell: float, period: float
) -> None:
    motion = BackAndForth(speed, travel, acceleration, repeats, dwell)
    assume(motion.ramp_travel <= travel)
    assume(motion.ramp_s >= 4 * period)  # shorter ramps are stretched to four samples
    command = motion.command(period)
    within = acceleration * period * (1 + 1e-9)
    assert np.max(np.abs(command)) <= speed
    assert abs(command[0]) <= within
    assert abs(command[-1]) <= within
    assert np.max(np.abs(np.diff(command))) <= within
    low, high = excursion(command, period)
    # half a sample of travel at either end, and ramps of a whole number of samples
    assert high == pytest.approx(travel, abs=1.6 * speed * period)
    assert low == pytest.approx(0.0, abs=1e-9)
    assert period * np.sum(command) == pytest.approx(0.0, abs=1e-9)
    assert period * len(command) == pytest.approx(motion.duration_s, abs=(8 * repeats + 1) * period)


@given(
    frequencies=st.lists(st.floats(0.05, 5.0), min_size=1, max_size=5),
    amplitude=st.floats(0.05, 1.5),
    turns=st.floats(1.0, 6.0),
    period=periods,
)
def test_sines(frequencies: list[float], amplitude: float, turns: float, period: float) -> None:
    slowest = min(frequencies)
    motion = Sines(tuple(frequencies), amplitude, turns / slowest)
    command = motion.command(period)
    assert np.max(np.abs(command)) == pytest.approx(amplitude)
    # the fade is half a cosine over an eighth of the slowest period; the sum's own peak scales both
    time = period * np.arange(len(command))
    phases = [2.399963 * k if len(frequencies) > 1 else 0.0 for k in range(len(frequencies))]
    raw = sum(np.sin(2 * math.pi * f * time + p) for f, p in zip(frequencies, phases, strict=True))
    middle = slice(len(command) // 4, -(len(command) // 4) or None)
    scale = amplitude / max(float(np.max(np.abs(np.asarray(raw)[middle]))), 1e-12)
    rise = min(0.125 / slowest, turns / slowest / 4) - 2 * period
    assume(rise > 4 * period)
    steepest = scale * (sum(2 * math.pi * f for f in frequencies) + len(frequencies) * 0.5 * math.pi / rise)
    assert np.max(np.abs(np.diff(command))) <= steepest * period
    assert abs(command[0]) <= steepest * period
    assert abs(command[-1]) <= steepest * period
    assert period * len(command) == pytest.approx(motion.duration_s, abs=period)


def test_dwells_stand_still() -> None:
    command = BackAndForth(0.2, 0.4, 2.0, repeats=2, dwell_s=0.5).command(0.01)
    still = np.flatnonzero(np.diff(np.concatenate([[1], (command == 0).astype(int) - 1, [1]])))
    assert np.count_nonzero(command == 0) == 5 * 50
    assert len(still) >= 2
    assert np.all(command[:50] == 0)
    assert np.all(command[-50:] == 0)


def test_a_sine_of_one_frequency_is_a_sine() -> None:
    command = Sines((0.5,), 0.6, 6.0).command(0.005)
    time = 0.005 * np.arange(len(command))
    inside = slice(60, -60)
    assert command[inside] == pytest.approx(0.6 * np.sin(np.pi * time)[inside], abs=1e-3)
