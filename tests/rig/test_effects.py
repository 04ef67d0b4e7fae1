"""Each effect changes the motor's torque by its formula."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from idtool.effects.registry import get
from idtool.effects.registry import names as library_names
from idtool.model.units import file_key
from idtool.rig.base import Trajectory, TrialSetup
from idtool.rig.plant_file import EFFECT_KEYS

from .support import FLAT, K, curve, play, rig_of, steady

W = 0.3
UP = TrialSetup(payload_kg=1.0, start_position=-1.0)
DOWN = TrialSetup(payload_kg=1.0, start_position=1.0)
LOAD = 0.62


def difference(name: str, speed: float = W, setup: TrialSetup | None = None, **numbers: Any) -> Any:
    """Torque with the effect minus the base model's at the true position, last 20 samples; and those."""
    setup = setup or (UP if speed > 0 else DOWN)
    run = steady(rig_of({"name": name, **numbers}), speed, setup)
    friction = np.array([curve(w) for w in run[2]])
    return run[3] - LOAD - friction, run


def test_torque_offset() -> None:
    np.testing.assert_allclose(difference("torque_offset", offset_nm=0.05)[0], 0.05, atol=1e-5)


@pytest.mark.parametrize("speed", [W, -W])
def test_direction_asymmetry(speed: float) -> None:
    change, _ = difference("direction_asymmetry", speed, asymmetry_nm_s_per_rad=0.04)
    np.testing.assert_allclose(change, 0.04 * W, atol=1e-5)


@pytest.mark.parametrize("speed", [W, -W])
def test_load_dependent_friction(speed: float) -> None:
    change, _ = difference("load_dependent_friction", speed, mu=0.1)
    np.testing.assert_allclose(change, math.copysign(0.1 * LOAD, speed), atol=1e-5)


@pytest.mark.parametrize(("speed", "mu"), [(W, 0.1), (-W, 0.03)])
def test_drive_backdrive(speed: float, mu: float) -> None:
    change, _ = difference("drive_backdrive", speed, mu_drive=0.1, mu_backdrive=0.03)
    np.testing.assert_allclose(change, math.copysign(mu * LOAD, speed), atol=1e-5)


def test_position_ripple() -> None:
    change, run = difference(
        "position_ripple",
        0.1,
        cycles_per_turn=6.0,
        amplitude_1_nm=0.02,
        phase_1_rad=0.4,
        amplitude_2_nm=0.01,
        phase_2_rad=1.0,
    )
    q = run[1]
    np.testing.assert_allclose(change, 0.02 * np.sin(6 * q + 0.4) + 0.01 * np.sin(12 * q + 1.0), atol=1.5e-3)


def test_position_dependent_friction() -> None:
    change, run = difference(
        "position_dependent_friction", slope_1=0.3, slope_2=0.1, center_rad=0.1, half_stroke_rad=2.0
    )
    x = (run[1] - 0.1) / 2.0
    expected = (curve(W) - 0.12 * W) * (0.3 * x + 0.1 * (2 * x * x - 1))
    np.testing.assert_allclose(change, expected, atol=5e-4)


def test_position_stiffness() -> None:
    change, run = difference("position_stiffness", stiffness_nm_per_rad=0.2, neutral_rad=0.3)
    np.testing.assert_allclose(change, 0.2 * (run[1] - 0.3), atol=1e-4)


def test_thermal_drift() -> None:
    setup = TrialSetup(payload_kg=1.0, start_position=-1.0, temperature_degc=45.0)
    change, _ = difference("thermal_drift", W, setup, rate_per_k=0.01, reference_degc=25.0)
    np.testing.assert_allclose(change, curve(W) * (math.exp(-0.2) - 1), atol=1e-5)


def test_warming_up_shows_in_friction_and_reading() -> None:
    warm = {"ambient_degc": 20.0, "rise_k": 15.0, "time_constant_s": 5.0, "sensor": True}
    rig = rig_of({"name": "thermal_drift", "rate_per_k": 0.02}, temperature=warm)
    cold = steady(rig, W, UP)[3].mean()
    rig.prepare(TrialSetup(rest_s=30.0))
    sample = rig.step(0.0)
    assert sample.temperature == pytest.approx(20 + 15 * (1 - math.exp(-sample.time_s / 5)), abs=0.01)
    assert steady(rig, W, UP)[3].mean() < cold - 0.005


def test_nonlinear_viscous() -> None:
    change, _ = difference("nonlinear_viscous", -W, quadratic_nm_s2_per_rad2=0.2)
    np.testing.assert_allclose(change, -0.2 * W * W, atol=1e-5)


def test_stribeck_shape() -> None:
    speed = 0.05
    change, _ = difference("stribeck_shape", speed, exponent=1.0)
    ratio = speed / 0.08
    np.testing.assert_allclose(change, 0.035 * (math.exp(-ratio) - math.exp(-(ratio**2))), atol=1e-5)


@pytest.mark.parametrize("speed", [W, -W])
def test_hysteresis_adds_its_yield_torque(speed: float) -> None:
    change, _ = difference("hysteresis", speed, stiffness_nm_per_rad=2.0, yield_nm=0.03)
    np.testing.assert_allclose(change, math.copysign(0.03, speed), atol=1e-5)


def test_torque_constant_saturation() -> None:
    _, run = difference("torque_constant_saturation", kappa_per_a=0.1)
    current = run[3] / K
    np.testing.assert_allclose(K * current * (1 - 0.1 * current), LOAD + curve(W), atol=1e-5)


def test_external_periodic() -> None:
    change, run = difference("external_periodic", frequency_hz=0.5, amplitude_nm=0.03, phase_rad=0.7)
    np.testing.assert_allclose(change, 0.03 * np.sin(np.pi * run[0] + 0.7), atol=2e-3)


def test_tilt_misalignment() -> None:
    setup = TrialSetup(1.0, 0.5, 0.2, start_position=-1.0)
    _, run = difference("tilt_misalignment", W, setup, alpha_rad=0.1, beta_rad=-0.05)
    np.testing.assert_allclose(run[3], LOAD * math.cos(0.6) * math.cos(0.15) + curve(W), atol=1e-5)


def sine(rig: Any, amplitude: float = 0.3, frequency: float = 1.0, setup: Any = None) -> Any:
    time = np.arange(800) * rig.period_s
    setup = setup or TrialSetup(tilt_alpha_rad=FLAT, start_position=0.0)
    return play(rig, amplitude * np.sin(2 * np.pi * frequency * time), setup)[:, 200:]


def test_inertia() -> None:
    """The torque in phase with acceleration grows by J a."""

    def in_phase(run: Any) -> float:
        a = np.gradient(run[2], run[0])
        columns = np.column_stack([a, run[2], np.tanh(run[2] / 0.02), np.ones(len(a))])
        return float(np.linalg.lstsq(columns, run[3], rcond=None)[0][0])

    base = in_phase(sine(rig_of()))
    more = in_phase(sine(rig_of({"name": "inertia", "inertia_kg_m2": 0.02})))
    assert more - base == pytest.approx(0.02, rel=0.05)


def test_compliance_moves_its_load_and_rings() -> None:
    numbers = {"stiffness_nm_per_rad": 60.0, "damping_nm_s_per_rad": 0.05, "load_inertia_kg_m2": 0.02}
    still = steady(rig_of({"name": "compliance", **numbers}), W, UP)
    np.testing.assert_allclose(still[3].mean(), LOAD + curve(W), atol=2e-3)  # no change when steady
    elastic = sine(rig_of({"name": "compliance", **numbers}), 0.3, 1.0)
    rigid = sine(rig_of({"name": "inertia", "inertia_kg_m2": 0.02}), 0.3, 1.0)
    assert np.ptp(elastic[3]) == pytest.approx(np.ptp(rigid[3]), rel=0.1)  # slow: moves as one


def test_backlash_takes_its_share_out_inside_the_gap() -> None:
    gap = {"name": "backlash", "gap_rad": 0.06, "share_behind_gap": 0.5}
    run, base = sine(rig_of(gap), 0.6), sine(rig_of(), 0.6)
    less = np.abs(base[3]) - np.abs(run[3])
    assert 0.3 * 0.115 < less[np.abs(run[2]) > 0.25].max() < 0.5 * 0.115 + 0.01
    far = np.argmax(np.abs(run[2]))  # at top speed the gap is crossed
    assert abs(run[3][far]) == pytest.approx(curve(abs(run[2][far])), abs=0.01)
    loaded = sine(rig_of(gap), setup=UP)
    np.testing.assert_allclose(loaded[3], sine(rig_of(), setup=UP)[3], atol=1e-9)  # gravity closes it


def test_transport_delay_shifts_position_and_velocity_against_current() -> None:
    late, now = sine(rig_of({"name": "transport_delay", "delay_s": 0.0075})), sine(rig_of())
    np.testing.assert_allclose(late[3], now[3], atol=1e-12)
    shifted = np.interp(now[0] - 0.0075, now[0], now[2])
    np.testing.assert_allclose(late[2][5:], shifted[5:], atol=1e-3)


def test_the_duty_is_that_of_now_however_late_the_motion_is_read() -> None:
    """The back-EMF in it is of the speed that the winding has, not of the one that is reported."""
    command, duties = 1.5 * np.sin(0.05 * np.arange(200)), []
    for effects in ((), ({"name": "transport_delay", "delay_s": 0.0075},)):
        rig = rig_of(*effects, sensors="feetech", motor={"supply_v": 12.0, "resistance_ohm": 2.0})
        rig.prepare(TrialSetup())
        blocks = list(rig.play(Trajectory(rig.period_s, "velocity", command)))
        duties.append(np.concatenate([block.duty for block in blocks]))
    np.testing.assert_array_equal(*duties)
    assert np.ptp(duties[0]) > 0.5


def test_a_longer_rest_needs_more_torque_to_break_away() -> None:
    def peak(rest: float) -> float:
        rig = rig_of({"name": "breakaway_dwell", "gain": 0.8, "time_constant_s": 3.0})
        setup = TrialSetup(tilt_alpha_rad=FLAT, start_position=0.0, rest_s=rest)
        return float(play(rig, np.full(400, 0.02), setup)[3].max())

    assert peak(20.0) > peak(0.2) + 0.02


EVERYTHING: list[dict[str, Any]] = [
    {"name": "inertia", "inertia_kg_m2": 0.01},
    {"name": "torque_offset", "offset_nm": 0.05},
    {"name": "direction_asymmetry", "asymmetry_nm_s_per_rad": 0.03},
    {"name": "load_dependent_friction", "mu": 0.05},
    {"name": "drive_backdrive", "mu_drive": 0.1, "mu_backdrive": 0.03},
    {"name": "position_ripple", "cycles_per_turn": 8.0, "amplitude_1_nm": 0.02},
    {"name": "position_dependent_friction", "slope_1": 0.3, "half_stroke_rad": 2.0},
    {"name": "position_stiffness", "stiffness_nm_per_rad": 0.1},
    {"name": "thermal_drift", "rate_per_k": 0.01},
    {"name": "nonlinear_viscous", "quadratic_nm_s2_per_rad2": 0.1},
    {"name": "stribeck_shape", "exponent": 1.2},
    {"name": "backlash", "gap_rad": 0.02, "share_behind_gap": 0.5},
    {"name": "hysteresis", "stiffness_nm_per_rad": 2.0, "yield_nm": 0.03},
    {"name": "compliance", "stiffness_nm_per_rad": 60.0, "load_inertia_kg_m2": 0.004},
    {"name": "transport_delay", "delay_s": 0.004},
    {"name": "torque_constant_saturation", "kappa_per_a": 0.05},
    {"name": "external_periodic", "frequency_hz": 0.3, "amplitude_nm": 0.02},
    {"name": "tilt_misalignment", "alpha_rad": 0.05},
    {"name": "breakaway_dwell", "gain": 0.5, "time_constant_s": 2.0},
]


def test_the_plant_file_knows_every_effect_and_its_keys() -> None:
    assert {entry["name"] for entry in EVERYTHING} == EFFECT_KEYS.keys()
    for name in library_names():
        known = {file_key(p.name, p.dimension, "rotary") for p in get(name).parameters}
        assert set(EFFECT_KEYS[name]) <= known, name


def test_a_plant_file_may_call_the_waves_of_a_ripple_by_their_older_name() -> None:
    ripple = {"amplitude_1_nm": 0.02}
    plants = [
        rig_of({"name": "position_ripple", key: 8.0} | ripple)
        for key in ("cycles_per_turn", "cycles_per_rad")
    ]
    torques = [sine(rig, 0.4, 0.5, UP)[2] for rig in plants]
    np.testing.assert_array_equal(torques[0], torques[1])


def test_all_of_them_at_once_stay_in_bounds() -> None:
    run = sine(rig_of(*EVERYTHING, seed=4), 0.4, 0.5, UP)
    assert np.isfinite(run).all()
    assert np.abs(run[2]).max() < 0.5
    assert np.abs(run[3]).max() < 1.5
