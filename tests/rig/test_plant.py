"""The simulated axis against closed formulas and another integrator."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from idtool.rig import open_rig
from idtool.rig.base import TrialSetup
from idtool.rig.plant_file import parse_plant
from idtool.rig.simulated import SimulatedRig

from .support import BENCH, FLAT, K, curve, play, record, rig_of, steady, table


@pytest.mark.parametrize("payload", [0.0, 0.7, 1.5])
def test_holding_torque_lies_within_friction_of_gravity(payload: float) -> None:
    rig = rig_of()
    torques = []
    for _ in range(60):
        rig.prepare(TrialSetup(payload_kg=payload, rest_s=0.1))
        sample = rig.step(0.0)
        assert abs(sample.velocity) < 1e-6
        torques.append(K * sample.current)
    gravity = 0.20 + 0.42 * payload
    deviation = np.array(torques) - gravity
    assert np.abs(deviation).max() <= 0.9 * 0.115 + 1e-6  # the bristle carries the rest
    assert np.ptp(deviation) > 0.1  # and by an amount that differs from trial to trial


@pytest.mark.parametrize("tilt", [(0.4, 0.0), (0.3, -0.5), (FLAT, 0.0)])
def test_gravity_follows_the_tilt(tilt: tuple[float, float]) -> None:
    rig = rig_of()
    setup = TrialSetup(1.0, *tilt, start_position=-0.9)
    back = TrialSetup(1.0, *tilt, start_position=0.9)
    mean = 0.5 * (steady(rig, 0.3, setup)[3].mean() + steady(rig, -0.3, back)[3].mean())
    assert mean == pytest.approx(0.62 * math.cos(tilt[0]) * math.cos(tilt[1]), abs=1e-5)


def test_an_arm_carries_a_sine() -> None:
    arm = {"kind": "arm", "sine_nm": 0.3, "cosine_nm": 0.1, "sine_per_payload_nm_per_kg": 0.2}
    rig = SimulatedRig(parse_plant(table() | {"gravity": arm}, Path("arm.toml")))
    run = play(rig, np.full(600, 0.3), TrialSetup(1.0, start_position=-1.0))[:, 300:]
    expected = 0.5 * np.sin(run[1]) + 0.1 * np.cos(run[1]) + [curve(w) for w in run[2]]
    np.testing.assert_allclose(run[3], expected, atol=2e-4)


@pytest.mark.parametrize("speed", [0.03, 0.08, 0.2, 0.6, -0.05, -0.4])
def test_steady_torque_is_the_stribeck_curve(speed: float) -> None:
    start = -math.copysign(1.2, speed)
    run = steady(rig_of(), speed, TrialSetup(tilt_alpha_rad=FLAT, start_position=start))
    assert run[2].mean() == pytest.approx(speed, abs=3e-5)
    assert run[3].mean() == pytest.approx(curve(run[2].mean()), abs=2e-4)


def test_the_curve_of_the_rig_that_comes_along() -> None:
    rig = open_rig("sim:bench", seed=3)
    run = steady(rig, 0.3, TrialSetup(tilt_alpha_rad=FLAT, start_position=-1.2), 5.0)
    assert run[3].mean() == pytest.approx(curve(0.3), abs=3 * 2e-3 * K / math.sqrt(20))


@pytest.mark.parametrize(("stiffness", "damping"), [(1e3, 2.0), (1e3, 0.0), (1e5, 1.0)])
def test_stiff_bristles_are_stable(stiffness: float, damping: float) -> None:
    rig = rig_of(
        friction={"bristle_stiffness_nm_per_rad": stiffness, "bristle_damping_nm_s_per_rad": damping}
    )
    time = np.arange(1200) * rig.period_s
    run = play(rig, 0.5 * np.sin(2 * np.pi * 0.5 * time), TrialSetup(tilt_alpha_rad=FLAT))
    assert np.abs(run[2]).max() < 0.6
    assert np.abs(run[3]).max() < 0.3


def test_agrees_with_another_integrator() -> None:
    """The measured torque, put into the differential equations of the axis, moves it as was measured."""
    rig = rig_of(period_s=0.001)
    time = np.arange(2000) * rig.period_s
    rig.prepare(TrialSetup(tilt_alpha_rad=FLAT, start_position=0.0))
    bristle = K * rig.step(0.0).current / 8.0  # at rest the motor carries the bristle alone
    run = record(rig, 0.4 * np.sin(2 * np.pi * 1.0 * time))
    at = run[0] - run[0][0]
    f = BENCH["friction"]

    def slope(t: float, y: np.ndarray) -> list[float]:
        _, w, z = y
        g = 0.08 + 0.035 * math.exp(-((w / 0.08) ** 2))
        rate = w - 8.0 * abs(w) / g * z
        friction = 8.0 * z + f["bristle_damping_nm_s_per_rad"] * rate + 0.12 * w
        return [w, (float(np.interp(t, at, run[3])) - friction) / 0.008, rate]

    start = [run[1][0], run[2][0], bristle]
    answer = solve_ivp(slope, (0, at[-1]), start, t_eval=at, rtol=1e-8, atol=1e-10, max_step=2e-3)
    np.testing.assert_allclose(answer.y[1], run[2], atol=2e-3)
    np.testing.assert_allclose(answer.y[0], run[1], atol=1e-3)


def test_a_push_takes_load_off_the_motor() -> None:
    rig = rig_of()
    rig.prepare(TrialSetup(payload_kg=1.0, start_position=0.0))
    before = rig.step(0.0).current
    samples = [rig.step(0.0, 0.5) for _ in range(400)]
    assert samples[3].position > 1e-5  # it gives way towards +q ...
    assert K * (samples[-1].current - before) == pytest.approx(-0.5, abs=0.24)  # ... friction aside
    assert abs(samples[-1].position) < 2e-2


def test_the_velocity_loop_is_stiff_and_damped() -> None:
    rig = rig_of()
    run = play(rig, np.full(200, 0.3), TrialSetup(payload_kg=0.5, start_position=0.0))
    assert run[2].max() < 0.3 * 1.05
    assert abs(run[2][40] - 0.3) < 0.01


@pytest.mark.parametrize("name", ["sim:paper", "sim:bench"])
def test_a_position_is_reached_with_little_overshoot(name: str) -> None:
    rig = open_rig(name)
    rig.prepare(TrialSetup(payload_kg=0.4, start_position=0.0))
    positions = [rig.step(0.02).position for _ in range(200)]
    assert max(positions) < 0.02 * 1.05
    assert abs(positions[60] - 0.02) < 1e-3


@pytest.mark.parametrize("payload", [0.0, 1.5])
def test_a_trial_starts_without_a_drop(payload: float) -> None:
    rig = rig_of({"name": "torque_offset", "offset_nm": 0.1})
    rig.prepare(TrialSetup(payload_kg=payload, start_position=0.3, rest_s=0.0))
    assert max(abs(rig.step(0.3).position - 0.3) for _ in range(50)) < 1e-9
