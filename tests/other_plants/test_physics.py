"""The other plant obeys mechanics, whatever the friction law and the effects."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from testbench.other_plants.motion import TICK, Drive, drive_axis, needed_torque
from testbench.other_plants.physics import ELASTO_PLASTIC, LUGRE, MAXWELL_SLIP, Array, Axis, Place, Plant
from testbench.other_plants.profiles import hold, move

AXIS = Axis(0.006, 0.07, 0.1, 0.05, 0.12, 5.0, 0.05, half_stroke=1.0)
DRIVE = Drive(15.0, 0.5, 8.0, 1.0, 5.0)
SIDE = Place(0.0, 0.0, 0.0, 0.0)
LAWS = [LUGRE, ELASTO_PLASTIC, MAXWELL_SLIP]
REST = 400
NOTHING = np.zeros((0, 4))
RIPPLE = np.array([[12.0, 0.02, 0.4, 0.6]])

#: Effects strong enough to show.
EFFECTS: dict[str, dict[str, float]] = {
    "none": {},
    "load": {"sine": 0.3, "cosine": 0.05, "mu": 0.1, "mu_raise": 0.05},
    "signs": {"offset": 0.02, "asymmetry": 0.03, "quadratic": 0.05},
    "position": {"slope": 0.3, "bowl": 0.2, "spring": 0.04, "spring_cubic": 0.02, "spring_neutral": 0.1},
    "thermal": {"thermal": 0.03, "rise": 15.0, "warm_up": 5.0},
    "shape": {"exponent": 0.8},
    "backlash": {"behind": 0.4, "gap": 0.04},
    "memory": {"yield_torque": 0.03, "memory_stiffness": 0.3},
    "compliance": {"load_inertia": 0.006, "load_stiffness": 15.0, "load_damping": 0.03},
    "saturation": {"saturation": 0.3},
    "periodic": {"periodic": 0.02, "periodic_hz": 0.7},
    "dwell": {"dwell": 1.0, "dwell_travel": 0.02},
    "tooth": {"tooth": 0.05, "bump": 0.03, "tooth_pitch": 2.0, "tooth_width": 0.03},
    "resonances": {"second_inertia": 0.002, "second_omega": 18.0, "third_omega": 40.0},
}


def sine(frequency: float = 0.5, seconds: float = 6.0, reach: float = 0.3) -> Array:
    t = np.arange(0.0, seconds, TICK)
    return np.concatenate([np.zeros(REST), reach * np.sin(2.0 * math.pi * frequency * t)])


def run(axis: Axis, wanted: Array, lines: Array = NOTHING, bristle: float = 0.0, finer: int = 1) -> Array:
    speed = np.diff(wanted, append=wanted[-1]) / TICK
    noise = np.zeros(len(wanted))
    return drive_axis(Plant(axis, lines), SIDE, DRIVE, wanted, speed, noise, bristle, REST, finer)


@pytest.mark.parametrize("law", LAWS)
def test_a_step_ten_times_finer_changes_nothing(law: int) -> None:
    axis = AXIS._replace(law=law)
    coarse, fine = run(axis, sine(), RIPPLE, 0.3), run(axis, sine(), RIPPLE, 0.3, finer=10)
    np.testing.assert_allclose(coarse[:, 0], fine[:, 0], atol=3e-5)
    assert np.sqrt(np.mean((coarse[:, 2] - fine[:, 2]) ** 2)) < 1e-3 * AXIS.coulomb


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("law", LAWS)
def test_the_torque_that_the_motion_asks_for_is_the_torque_that_made_it(law: int, name: str) -> None:
    if name == "backlash" and law != LUGRE:
        pytest.skip("backlash is put on LuGre axes alone")
    axis = AXIS._replace(law=law, **EFFECTS[name])
    motion = run(axis, sine(), RIPPLE, -0.4)
    needed = needed_torque(Plant(axis, RIPPLE), SIDE, motion, -0.4, REST)
    off = np.sqrt(np.mean((needed - motion[:, 2]) ** 2))
    assert off < 0.01 * AXIS.coulomb


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("speed", [0.02, 0.1, 0.4])
def test_steady_friction_is_the_stribeck_curve(law: int, speed: float) -> None:
    axis = AXIS._replace(law=law, damping=0.0 if law == MAXWELL_SLIP else AXIS.damping)
    for way in (1.0, -1.0):
        wanted = np.concatenate([np.zeros(REST), way * np.arange(0.0, 0.6, speed * TICK)])
        torque = run(axis, wanted)[-200:, 2].mean()
        bell = math.exp(-((speed / axis.stribeck_velocity) ** 2))
        steady = axis.coulomb + (axis.static - axis.coulomb) * bell + axis.viscous * speed
        assert torque == pytest.approx(way * steady, rel=0.01)


@pytest.mark.parametrize("law", LAWS)
def test_a_mirrored_command_gives_a_mirrored_torque(law: int) -> None:
    axis = AXIS._replace(law=law)
    one, other = run(axis, sine(), bristle=0.2), run(axis, -sine(), bristle=-0.2)
    np.testing.assert_allclose(one, -other, atol=1e-9)
    lopsided = axis._replace(asymmetry=0.03)
    assert np.max(np.abs(run(lopsided, sine())[:, 2] + run(lopsided, -sine())[:, 2])) > 0.02


@pytest.mark.parametrize("law", LAWS)
def test_friction_takes_energy_and_the_rest_keeps_it(law: int) -> None:
    """Work of the motor = kinetic + potential energy + what friction took, which only grows."""
    axis = AXIS._replace(law=law, sine=0.2, spring=0.05)
    motion = run(axis, sine())[REST:]
    q, w, torque = motion[:, 0], motion[:, 1], motion[:, 2]
    work = np.concatenate([[0.0], np.cumsum(torque[:-1] * np.diff(q))])  # the torque is held for a tick
    stored = 0.5 * axis.inertia * w**2 - axis.sine * np.cos(q) + 0.5 * axis.spring * q**2
    taken = work - (stored - stored[0])
    half_period = 1000
    assert np.all(np.diff(taken[::half_period]) > 0.0)
    bristle = 0.5 * axis.static**2 / axis.stiffness  # what a bent bristle may give back
    assert np.min(np.diff(taken)) > -bristle


@pytest.mark.parametrize("law", LAWS)
def test_without_friction_energy_stays(law: int) -> None:
    axis = AXIS._replace(law=law, coulomb=1e-9, static=1e-9, viscous=0.0, stiffness=1e-6, damping=0.0)
    axis = axis._replace(sine=0.2, load_inertia=0.004, load_stiffness=4.0)
    wanted = np.concatenate([np.full(REST, 0.8), np.full(3000, 0.8)])
    noise = np.zeros(len(wanted))
    free = Drive(0.0, 0.0, 0.0, 0.0, 5.0)
    # let it fall: hold nothing, from 0.8 rad (the start torque of gravity is taken off again)
    noise -= axis.sine * math.sin(0.8)
    motion = drive_axis(Plant(axis), SIDE, free, wanted, 0.0 * wanted, noise, 0.0, 0, 1)
    without = axis._replace(load_inertia=0.0)
    spring_torque = -motion[:, 3] * axis.inertia - axis.sine * np.sin(motion[:, 0])
    assert np.max(np.abs(spring_torque)) > 0.01  # the second mass is felt
    alone = drive_axis(Plant(without), SIDE, free, wanted, 0.0 * wanted, noise, 0.0, 0, 1)
    energy = 0.5 * axis.inertia * alone[:, 1] ** 2 - axis.sine * np.cos(alone[:, 0])
    np.testing.assert_allclose(energy, energy[0], atol=1e-6)


@pytest.mark.parametrize("law", [LUGRE, ELASTO_PLASTIC])
def test_small_pushes_meet_the_bristle_as_a_spring(law: int) -> None:
    axis = AXIS._replace(law=law)
    small = 0.02 * axis.static / axis.stiffness
    wanted = np.concatenate([np.zeros(REST), move(0.0, small, small, "s-curve", 0.5), hold(small, 2.0)])
    motion = run(axis, wanted)
    assert motion[-1, 2] == pytest.approx(axis.stiffness * motion[-1, 0], rel=0.03)


def _difference(wanted: Array, lines: Array = NOTHING, **numbers: Any) -> tuple[Array, Array]:
    """What numbers add to the torque of the motion that they have, and that motion."""
    axis = AXIS._replace(**numbers)
    motion = run(axis, wanted, lines)
    whole = needed_torque(Plant(axis, lines), SIDE, motion, 0.0, REST)
    plain = needed_torque(Plant(AXIS), SIDE, motion, 0.0, REST)
    return (whole - plain)[REST:], motion[REST:]


def test_additive_effects_have_their_formulas() -> None:
    q_w = {
        "offset": lambda q, w: 0.02 + 0.0 * q,
        "asymmetry": lambda q, w: 0.02 * np.abs(w),
        "quadratic": lambda q, w: 0.02 * np.abs(w) * w,
        "spring": lambda q, w: 0.02 * (q - 0.1),
    }
    for name, formula in q_w.items():
        added, motion = _difference(sine(), **{name: 0.02, "spring_neutral": 0.1})
        np.testing.assert_allclose(added, formula(motion[:, 0], motion[:, 1]), atol=1e-9)
    added, motion = _difference(sine(), np.array([[12.0, 0.02, 0.4, 0.0]]))
    np.testing.assert_allclose(added, 0.02 * np.sin(12.0 * motion[:, 0] + 0.4), atol=1e-9)


def test_the_part_behind_the_gap_is_not_felt_while_the_gap_is_crossed() -> None:
    axis = AXIS._replace(stiffness=60.0, damping=0.01)
    there, back = move(0.0, 0.4, 0.2, "s-curve", 0.1), move(0.4, 0.0, 0.2, "s-curve", 0.1)
    wanted = np.concatenate([np.zeros(REST), there, back])
    motion = run(axis._replace(behind=0.5, gap=0.1), wanted)
    turn = REST + len(there)
    crossing = turn + int(np.argmax(motion[turn:, 0] < motion[turn, 0] - 0.06))
    met = turn + int(np.argmax(motion[turn:, 0] < motion[turn, 0] - 0.2))
    assert motion[crossing, 2] == pytest.approx(0.5 * motion[met, 2], rel=0.1)


def test_a_longer_rest_sticks_harder() -> None:
    peaks = []
    for rest in (0.1, 3.0):
        axis = AXIS._replace(stiffness=60.0, damping=0.01, dwell=1.0, dwell_travel=0.05)
        first = move(0.0, 0.3, 0.2, "s-curve", 0.1)
        wanted = np.concatenate(
            [np.zeros(REST), first, hold(0.3, rest), move(0.3, 0.6, 0.05, "s-curve", 1.0)]
        )
        motion = run(axis, wanted)
        peaks.append(np.max(motion[REST + len(first) + int(rest / TICK) :, 2]))
    assert peaks[1] > peaks[0] + 0.1 * AXIS.coulomb


def test_a_saturating_motor_needs_more_current_than_torque() -> None:
    axis = AXIS._replace(sine=0.5, saturation=0.3)
    motion = run(axis, sine(0.1, 10.0, 0.9))
    against = needed_torque(Plant(axis._replace(saturation=0.0)), SIDE, motion, 0.0, REST)
    u = motion[:, 2]
    np.testing.assert_allclose((u * (1.0 - 0.3 * np.abs(u)))[REST:], against[REST:], atol=2e-3)
