"""The torque model: exact integration, and every derivative against differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from idtool.model import lugre
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion
from idtool.model.stribeck import level
from idtool.model.torque import At, Direction, Friction, linearise, predict

SOFT = Friction(0.07, 0.03, 0.09, 0.155, 0.051, 0.297)
STIFF = Friction(0.08, 0.115, 0.08, 0.12, 400.0, 0.2)


def motion(rows: int = 400, trials: int = 2) -> Motion:
    """Sums of sines through zero, several trials."""
    parts = []
    for trial in range(trials):
        t = 0.005 * np.arange(rows)
        w = 0.4 * np.sin(2 * np.pi * (0.7 + 0.2 * trial) * t + 0.4) + 0.1 * np.cos(2 * np.pi * 2.1 * t)
        parts.append((t + 10 * trial, w, np.full(rows, trial)))
    time, velocity, trial_index = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    position = np.concatenate([np.cumsum(p[1]) * 0.005 for p in parts])
    acceleration = np.concatenate([np.gradient(p[1], 0.005) for p in parts])
    return Motion(time, trial_index.astype(np.intp), position, velocity, acceleration)


def test_agrees_with_an_ode_solver() -> None:
    m = motion(rows=200, trials=1)
    f = replace(STIFF, bristle_stiffness=8.0)

    def rate(t: float, z: np.ndarray) -> np.ndarray:
        w = np.interp(t, m.time, m.velocity)
        g = level(float(w), f.coulomb, f.static, f.stribeck_velocity)
        return w - f.bristle_stiffness * abs(w) / g * z

    reference = solve_ivp(
        rate, (0.0, m.time[-1]), [0.004], t_eval=m.time, rtol=1e-9, atol=1e-12, max_step=1e-3
    )
    z = predict(m, f, Contribution(), np.array([0.004])).bristle
    # the only difference is the mid-point rule within a step of 5 ms
    assert np.max(np.abs(z - reference.y[0])) < 0.004 * np.max(np.abs(z))


def test_a_level_that_falls_within_one_step_gives_no_pulse_of_damping() -> None:
    f = Friction(0.01, 0.1, 0.05, 0.0, 200.0, 1.0)

    def velocity(t: np.ndarray) -> np.ndarray:
        return np.asarray(0.03 + 0.47 * np.clip((t - 0.05) / 0.05, 0.0, 1.0))

    def torque(period: float) -> np.ndarray:
        t = period * np.arange(round(0.2 / period) + 1)
        trial = np.zeros(len(t), dtype=np.intp)
        m = Motion(t, trial, np.cumsum(velocity(t)) * period, velocity(t), np.gradient(velocity(t), period))
        return predict(m, f, Contribution(), np.array([0.1 / 200.0])).torque

    exact = torque(1e-5)[::1000]
    assert torque(0.01) == pytest.approx(exact, abs=0.02 * f.static)


@given(
    speed=st.floats(-2.0, 2.0),
    seconds=st.floats(1e-4, 5.0),
    stiffness=st.floats(1e-3, 1e6),
    start=st.floats(-1.0, 1.0),
    pieces=st.integers(1, 20),
)
@settings(max_examples=200)
def test_a_step_of_constant_speed_may_be_cut_into_any_number(
    speed: float, seconds: float, stiffness: float, start: float, pieces: int
) -> None:
    def end(n: int) -> float:
        rows = n + 1
        step = np.full(rows, seconds / n)
        step[0] = 0.0
        first = np.zeros(rows, dtype=bool)
        first[0] = True
        z, _ = lugre.propagate(
            np.full(rows, speed), step, np.full(rows, stiffness / 0.1), first, np.array([start])
        )
        return float(z[-1])

    whole = end(1)
    assert np.isfinite(whole)
    assert end(pieces) == pytest.approx(whole, rel=1e-6, abs=1e-9)
    assert abs(whole) <= max(abs(start), 0.1 / stiffness) * (1 + 1e-9) + abs(speed) * 0.0


@given(scale=st.sampled_from([0.05, 1.0, 400.0]))
@settings(max_examples=3)
def test_turning_the_motion_round_turns_the_friction_round(scale: float) -> None:
    m = motion()
    turned = replace(m, velocity=-m.velocity, position=-m.position, acceleration=-m.acceleration)
    f = replace(STIFF, bristle_stiffness=scale)
    start = np.array([0.01, -0.02])
    one = predict(m, f, Contribution(), start).torque
    other = predict(turned, f, Contribution(), -start).torque
    assert other == pytest.approx(-one, abs=1e-12)


def test_is_linear_in_the_start() -> None:
    m = motion()
    at_zero = predict(m, SOFT, Contribution(), np.zeros(2))
    start = np.array([0.3, -0.7])
    moved = predict(m, SOFT, Contribution(), start)
    assert moved.torque == pytest.approx(at_zero.torque + at_zero.start_column * start[m.trial], abs=1e-12)


PARAMETERS = ("coulomb", "static", "stribeck_velocity", "viscous", "bristle_stiffness", "bristle_damping")
FIELDS = ("torque", "level_change", "level_torque", "static_change", "viscous_change", "exponent_change")


@pytest.mark.parametrize("friction", [SOFT, STIFF], ids=["soft", "stiff"])
@pytest.mark.parametrize("name", PARAMETERS)
def test_derivatives_of_the_friction_parameters(friction: Friction, name: str) -> None:
    m, start = motion(), np.array([0.001, -0.002])
    effect = Contribution(level_change=0.1 * np.sin(m.position), static_change=0.05)
    value = getattr(friction, name)
    increment = 1e-5 * value
    high, low = (
        predict(m, replace(friction, **{name: value + sign * increment}), effect, start).torque
        for sign in (1, -1)
    )
    _, derivatives = linearise(m, friction, effect, start, [replace(Direction(), **{name: 1.0})])
    expected = (high - low) / (2 * increment)
    assert np.max(np.abs(next(derivatives) - expected)) < 1e-4 * np.max(np.abs(expected))


@pytest.mark.parametrize("friction", [SOFT, STIFF], ids=["soft", "stiff"])
@pytest.mark.parametrize("name", FIELDS)
def test_derivatives_of_what_effects_change(friction: Friction, name: str) -> None:
    m, start = motion(), np.array([0.001, -0.002])
    shape = 0.02 * (1.0 + 0.5 * np.sin(3 * m.position)) if name != "exponent_change" else 0.3
    increment = 1e-4

    def torque(amount: float) -> np.ndarray:
        return predict(m, friction, Contribution(**{name: amount * shape}), start).torque

    expected = (torque(0.5 + increment) - torque(0.5 - increment)) / (2 * increment)
    effect = Contribution(**{name: 0.5 * shape})
    _, derivatives = linearise(m, friction, effect, start, [Direction(effect=Contribution(**{name: shape}))])
    assert np.max(np.abs(next(derivatives) - expected)) < 1e-4 * np.max(np.abs(expected))


@pytest.mark.parametrize(
    ("name", "amount", "increment"),
    [("delay", 0.0123, 1e-6), ("saturation", 0.4, 1e-5), ("gain_change", 0.2, 1e-5)],
)
def test_derivatives_of_what_acts_on_the_finished_torque(name: str, amount: float, increment: float) -> None:
    m, start = motion(), np.zeros(2)

    def torque(value: float) -> np.ndarray:
        return predict(m, STIFF, Contribution(**{name: value}), start).torque

    expected = (torque(amount + increment) - torque(amount - increment)) / (2 * increment)
    _, derivatives = linearise(
        m, STIFF, Contribution(**{name: amount}), start, [Direction(effect=Contribution(**{name: 1.0}))]
    )
    inside = np.ones(len(m), dtype=bool)
    inside[m.starts] = inside[m.starts - 1] = False  # a delay is held at the ends of a trial
    column = next(derivatives)
    worst = np.max(np.abs(column[inside] - expected[inside]))
    assert worst < 1e-3 * np.max(np.abs(expected)) or name == "delay"
    assert np.median(np.abs(column - expected)) < 1e-3 * np.max(np.abs(expected))


def test_what_only_adds_a_torque() -> None:
    """Asked without comparing arrays, whose truth Python 3.13 wants to know in such a comparison."""
    torque = np.array([0.1, 0.2])
    assert Contribution(torque=torque).only_torque
    assert not Contribution().only_torque
    assert not Contribution(torque=torque, level_change=torque).only_torque
    assert not Contribution(torque=torque, delay=0.002).only_torque


def test_a_bristle_bends_to_the_level_where_it_starts() -> None:
    both = motion(rows=50)
    first = np.flatnonzero(both.begins)
    change = np.zeros(len(both))
    change[first[1]] = 0.5
    change[first[0] + 7] = 3.0  # elsewhere, however much
    for friction, most in ((STIFF, STIFF.static), (SOFT, SOFT.coulomb)):
        bend = At(both, friction, Contribution(level_change=change)).furthest_bend
        np.testing.assert_allclose(bend * friction.bristle_stiffness, [most, 1.5 * most])
