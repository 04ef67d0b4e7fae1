"""What is impossible is named, latched and held; no input gets a command outside the limits."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from idtool.control import ForceFreeController, Limits, Reason, State
from idtool.control.guard import Guard, Measurement, check_torque
from idtool.errors import InputError

from .double import parameters

LIMITS = Limits(position_min=-1.0, position_max=1.0, command_step=0.2)
CURRENT = 0.23 / 2.67  # what holds the slide


def started(limits: Limits = LIMITS, samples: int = 40) -> ForceFreeController:
    controller = ForceFreeController(parameters(), 0.01, limits=limits)
    for k in range(samples):
        controller.step(0.3, 0.0, CURRENT, time_s=0.01 * k)
    assert controller.status.fault is None
    return controller


NOW = 0.40
GOOD = {"position_rad": 0.3, "velocity_rad_s": 0.0, "current_a": CURRENT, "time_s": NOW}


@pytest.mark.parametrize(
    ("change", "reason", "words"),
    [
        ({"position_rad": math.nan}, Reason.NOT_FINITE, "position is nan"),
        ({"velocity_rad_s": math.inf}, Reason.NOT_FINITE, "velocity is inf"),
        ({"current_a": None}, Reason.NOT_FINITE, "current is nan"),
        ({"current_a": "text"}, Reason.NOT_FINITE, "current is nan"),
        ({"time_s": math.nan}, Reason.NOT_FINITE, "time is nan"),
        ({"time_s": 0.39}, Reason.STALE, "came twice"),
        ({"time_s": 0.20}, Reason.TIME_JUMP, "time went from"),
        ({"time_s": 0.60}, Reason.TIME_JUMP, "time went from"),
        ({"position_rad": 0.9}, Reason.POSITION_JUMP, "position went from 0.3"),
        ({"velocity_rad_s": 20.0}, Reason.VELOCITY, "velocity of 20"),
        ({"current_a": -30.0}, Reason.CURRENT, "current of -30"),
        ({"position_rad": 1.2}, Reason.OUT_OF_RANGE, "outside -1 to 1"),
        ({"payload_kg": math.nan}, Reason.SURROUNDINGS, "payload is nan"),
        ({"payload_kg": -1.0}, Reason.SURROUNDINGS, "impossible"),
        ({"tilt_alpha_rad": 1e9}, Reason.SURROUNDINGS, "impossible"),
        ({"temperature_degc": math.inf}, Reason.SURROUNDINGS, "temperature is inf"),
    ],
)
def test_each_fault_holds_and_says_so(change: dict[str, Any], reason: Reason, words: str) -> None:
    controller = started()
    assert controller.step(**{**GOOD, **change}) == pytest.approx(0.3)
    status = controller.status
    assert status.state is State.FAULT
    assert status.fault is not None
    assert status.fault.reason is reason
    assert words in status.message
    assert "holds the last safe position" in status.message
    assert "recover()" in status.message
    assert len(status.fault.history) == 41

    # latched: good samples do not bring it back by themselves
    for k in range(5):
        assert controller.step(0.35, 0.0, CURRENT, time_s=NOW + 0.01 * (k + 1)) == pytest.approx(0.3)
    assert controller.status.state is State.FAULT

    controller.recover()
    controller.step(0.35, 0.0, CURRENT, time_s=1.0)
    assert controller.status.state is State.STARTING
    assert controller.status.fault is None
    assert controller.step(0.35, 0.0, CURRENT, time_s=1.01) == pytest.approx(0.35)


def test_a_frozen_measurement_is_stale_without_a_clock() -> None:
    controller = ForceFreeController(parameters(), 0.01)
    for _ in range(40):
        controller.step(0.3, 0.5, CURRENT)
    fault = controller.status.fault
    assert fault is not None
    assert fault.reason is Reason.STALE
    assert "alike" in fault.message


def test_a_standing_axis_may_repeat_itself() -> None:
    controller = ForceFreeController(parameters(), 0.01)
    for _ in range(500):
        controller.step(0.3, 0.0, CURRENT)
    assert controller.status.fault is None


def test_nothing_known_is_not_to_be_sent() -> None:
    controller = ForceFreeController(parameters(), 0.01, limits=LIMITS)
    assert math.isfinite(controller.step(math.nan, 0.0, 0.0))
    assert not controller.status.command_valid
    assert "send nothing" in controller.status.message


def test_the_range_cuts_the_command() -> None:
    """A hand that pushes at the end of the stroke does not get past it."""
    controller = ForceFreeController(parameters(), 0.01, limits=Limits(-1.0, 1.0))
    limited = set()
    for k in range(200):
        pushed = CURRENT if k < 40 else CURRENT - 0.2
        assert controller.step(0.995, 0.0, pushed) <= 1.0
        limited |= set(controller.status.limited)
    assert limited == {"range"}


def test_the_speed_is_cut() -> None:
    controller = ForceFreeController(parameters(), 0.01, limits=Limits(speed=0.1))
    for k in range(60):
        controller.step(0.3, 0.0, CURRENT if k < 40 else CURRENT - 0.5)
    assert controller.status.limited == ("speed",)
    assert controller.status.velocity_wanted == pytest.approx(0.1)


@pytest.mark.parametrize(
    "bad",
    [
        {"position_min": 1.0, "position_max": 1.0},
        {"position_min": math.nan},
        {"speed": 0.0},
        {"command_step": 0.0},
        {"command_step": math.inf},
        {"current": math.nan},
        {"margin": -1.0},
        {"stale_samples": 1},
    ],
)
def test_limits_are_checked(bad: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        Limits(**bad)


wild = st.floats(allow_nan=True, allow_infinity=True)
near = st.floats(-1.5, 1.5)
number = st.one_of(near, near, near, wild)
sample = st.tuples(
    number,
    number,
    number,
    st.one_of(st.just(0.4), wild),
    st.one_of(st.just(0.0), wild),
    st.one_of(st.none(), st.just(25.0), wild),
    st.one_of(st.none(), st.just(0.01), wild),
    st.booleans(),
)


@settings(max_examples=150)
@given(
    st.lists(sample, max_size=60), st.booleans(), st.booleans(), st.sampled_from(["paper", "light", "tared"])
)
def test_any_input_gives_a_finite_command_inside_the_limits(
    rows: list[tuple[Any, ...]], stiff: bool, effects: bool, mode: str
) -> None:
    from .double import BENCH, PAPER

    numbers = {"thermal_drift": {"rate": 0.5, "reference": 25.0}, "inertia": {"inertia": 0.02}}
    file = parameters(BENCH if stiff else PAPER, **(numbers if effects else {}))
    law = "paper" if mode == "paper" else "light"
    controller = ForceFreeController(file, 0.01, mode=law, limits=LIMITS, settle_s=0.03)
    before: float | None = None
    clock = 0.0
    for position, velocity, current, payload, tilt, warm, step, recover in rows:
        clock = clock + step if step is not None else clock
        if recover:
            controller.recover()
        if mode == "tared":
            controller.tare()
        command = controller.step(
            position, velocity, current, payload, tilt, tilt, warm, time_s=None if step is None else clock
        )
        assert math.isfinite(command)
        assert LIMITS.position_min <= command <= LIMITS.position_max
        assert LIMITS.command_step is not None
        if before is not None and controller.status.command_valid:
            assert abs(command - before) <= LIMITS.command_step * (1 + 1e-12)
        before = command if controller.status.command_valid else None
        status = controller.status
        assert math.isfinite(status.external_torque)
        assert math.isfinite(status.uncertainty)
        assert status.message


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.floats(-0.01, 0.01), st.floats(-0.3, 0.3)), min_size=80, max_size=200),
    st.booleans(),
)
def test_any_plausible_motion_is_followed_inside_the_limits(
    rows: list[tuple[float, float]], tare: bool
) -> None:
    """Long runs without a fault: pushes of any strength, the axis moving anyhow."""
    controller = ForceFreeController(parameters(), 0.01, mode="light", limits=LIMITS)
    place, before = 0.3, None
    for k, (travel, push) in enumerate(rows):
        place = min(max(place + (travel if k > 30 else 0.0), -0.99), 0.99)
        current = CURRENT - (push / 2.67 if k > 30 else 0.0)
        if tare and k == 30:
            controller.tare()
        command = controller.step(place, travel / 0.01 if k > 30 else 0.0, current, time_s=0.01 * k)
        assert LIMITS.position_min <= command <= LIMITS.position_max
        assert LIMITS.command_step is not None
        assert before is None or abs(command - before) <= LIMITS.command_step * (1 + 1e-12)
        assert abs(controller.status.velocity_wanted) <= LIMITS.speed
        before = command


def test_the_bounds_that_hold_where_nobody_set_any() -> None:
    assert Limits() == Limits(
        position_min=-math.inf,
        position_max=math.inf,
        margin=0.05,
        speed=3.0,
        command_step=None,
        measured_speed=12.0,
        current=10.0,
        torque=math.inf,
        mismatch=None,
        guided_speed=math.inf,
        energy=math.inf,
        idle_s=math.inf,
        stale_samples=5,
        gap_periods=5.0,
    )
    assert Measurement(1.0, 2.0, 3.0, 4.0) == Measurement(1.0, 2.0, 3.0, 4.0, 0.0, 0.0, 0.0, None)


#: A period that floats count exactly, s.
PERIOD = 2.0**-7


def guard(**limits: float) -> Guard:
    return Guard(Limits(**limits), PERIOD, 2.0**-10, "rad")


def reason(found: tuple[Reason, str] | None) -> Reason | None:
    return None if found is None else found[0]


@pytest.mark.parametrize(
    ("name", "last_good", "first_bad", "expected"),
    [
        ("payload", 1e4, 1.00001e4, Reason.SURROUNDINGS),
        ("payload", 0.0, -1e-9, Reason.SURROUNDINGS),
        ("tilt_alpha", 10.0, 10.001, Reason.SURROUNDINGS),
        ("tilt_beta", -10.0, -10.001, Reason.SURROUNDINGS),
        ("temperature", 400.0, 400.5, Reason.SURROUNDINGS),
        ("temperature", -90.0, -90.5, Reason.SURROUNDINGS),
        ("position", 1e6, 1000000.5, Reason.OUT_OF_RANGE),
        ("position", -1e6, -1000000.5, Reason.OUT_OF_RANGE),
        ("velocity", 12.0, 12.001, Reason.VELOCITY),
        ("velocity", -12.0, -12.001, Reason.VELOCITY),
        ("current", 10.0, 10.001, Reason.CURRENT),
        ("current", -10.0, -10.001, Reason.CURRENT),
    ],
)
def test_where_a_measurement_becomes_impossible(
    name: str, last_good: float, first_bad: float, expected: Reason
) -> None:
    good = Measurement(0.0, 0.0, 0.0, 0.0)
    assert guard().check(replace(good, **{name: last_good}), clocked=True) is None
    assert reason(guard().check(replace(good, **{name: first_bad}), clocked=True)) is expected


def test_an_axis_may_be_measured_outside_its_range_by_the_margin() -> None:
    for position, outside in ((1.25, False), (1.2501, True), (-2.25, False), (-2.2501, True)):
        found = guard(position_min=-2.0, position_max=1.0, margin=0.25)
        told = reason(found.check(Measurement(0.0, position, 0.0, 0.0), clocked=True))
        assert told is (Reason.OUT_OF_RANGE if outside else None)


def after(step: float, position: float = 0.0, *, clocked: bool = True) -> Reason | None:
    found = guard(gap_periods=5.0, measured_speed=8.0)
    assert found.check(Measurement(1.0, 0.0, 0.0, 0.0), clocked=clocked) is None
    return reason(found.check(Measurement(1.0 + step, position, 0.0, 0.0), clocked=clocked))


def test_time_goes_on_by_five_periods_at_most() -> None:
    assert after(5.0 * PERIOD) is None
    assert after(5.01 * PERIOD) is Reason.TIME_JUMP
    assert after(-PERIOD) is Reason.TIME_JUMP
    assert after(0.0) is Reason.STALE
    assert after(0.0, clocked=False) is None  # counted, not measured


def test_a_position_moves_no_further_than_its_speed_and_one_period_of_grace() -> None:
    for way in (1.0, -1.0):
        assert after(2.0 * PERIOD, way * 8.0 * 3.0 * PERIOD) is None
        assert after(2.0 * PERIOD, way * 8.0 * 3.01 * PERIOD) is Reason.POSITION_JUMP


def alike(samples: int, velocity: float, /, **change: float) -> list[Reason | None]:
    found = guard(stale_samples=4)
    same = Measurement(0.0, 0.5, velocity, 0.1)
    rows = [replace(same, time=k * PERIOD) for k in range(samples)]
    rows[-1] = replace(rows[-1], **change)
    return [reason(found.check(row, clocked=True)) for row in rows]


def test_samples_alike_are_stale_while_the_axis_is_said_to_move() -> None:
    assert alike(5, 1.0) == [None] * 4 + [Reason.STALE]
    assert alike(5, -1.0) == [None] * 4 + [Reason.STALE]
    for name in ("position", "velocity", "current"):
        assert alike(5, 1.0, **{name: 0.51}) == [None] * 5
    # 4 periods at 0.09 rad/s are less than three counts, 5 are more
    assert alike(6, 0.09) == [None] * 5 + [Reason.STALE]


def test_a_bad_sample_is_not_what_the_next_is_held_against() -> None:
    found = guard()
    assert found.check(Measurement(0.0, 0.0, 0.0, 0.0), clocked=True) is None
    assert found.check(Measurement(PERIOD, 9.0, 0.0, 0.0), clocked=True) is not None
    assert found.check(Measurement(2.0 * PERIOD, 0.01, 0.0, 0.0), clocked=True) is None
    found.reset()
    assert found.check(Measurement(0.0, 9.0, 0.0, 0.0), clocked=True) is None


def test_a_torque_that_no_hand_has() -> None:
    for torque, expected in ((2.0, None), (2.01, Reason.TORQUE), (-2.0, None), (-2.01, Reason.TORQUE)):
        assert reason(check_torque(Limits(torque=2.0), torque, "N m")) is expected


@pytest.mark.parametrize(
    "name",
    [
        "speed",
        "measured_speed",
        "current",
        "torque",
        "gap_periods",
        "guided_speed",
        "energy",
        "idle_s",
        "mismatch",
    ],
)
def test_no_limit_is_zero_or_less(name: str) -> None:
    Limits(**{name: 1e-3})
    for value in (0.0, -1.0, math.nan):
        with pytest.raises(InputError, match=name):
            Limits(**{name: value})
