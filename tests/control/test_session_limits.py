"""What ends a guiding that no hand wants: too fast, energy to the hand, nobody for too long."""

from __future__ import annotations

import pytest

from idtool.control.guard import Limits, Measurement, Reason, State
from idtool.control.session_limits import SessionLimits

PERIOD = 0.01


def watched(**limits: float) -> SessionLimits:
    return SessionLimits(Limits(**limits), PERIOD, "rad")


def sample(velocity: float) -> Measurement:
    return Measurement(0.0, 0.0, velocity, 0.0)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_guided_axis_beyond_the_session_s_speed_is_stopped(way: float) -> None:
    session = watched(guided_speed=0.5)
    assert session.check(sample(0.5 * way), 0.1, State.GUIDING) is None
    fault = session.check(sample(0.51 * way), 0.1, State.GUIDING)
    assert fault is not None
    assert fault[0] is Reason.SPEED_LIMIT
    assert "guided at 0.51 rad/s, faster than the session's 0.5 rad/s" in fault[1]
    assert session.check(sample(9.0), 0.1, State.STOPPING) is None  # only a guided one


def spent(torque: float, velocity: float, samples: int, session: SessionLimits) -> tuple[Reason, str] | None:
    fault = None
    for _ in range(samples):
        fault = fault or session.check(sample(velocity), torque, State.GUIDING)
    return fault


def test_an_axis_that_pushes_the_hand_is_stopped_at_the_limit() -> None:
    """1 N m against 0.5 rad/s is 5 mJ a sample."""
    assert spent(-1.0, 0.5, 10, watched(energy=0.052)) is None
    fault = spent(1.0, -0.5, 11, watched(energy=0.052))
    assert fault is not None
    assert fault[0] is Reason.ENERGY
    assert "gave 0.055 J" in fault[1]


def test_what_was_given_long_ago_is_no_credit() -> None:
    session = watched(energy=0.05)
    assert spent(1.0, 0.5, 500, session) is None  # 2.5 J from the hand count as 0.05
    assert spent(-1.0, 0.5, 20, session) is None
    assert spent(-1.0, 0.5, 1, session) is not None


@pytest.mark.parametrize("between", [State.RESTING, State.STOPPING, State.HELD])
def test_every_guiding_has_an_account_of_its_own(between: State) -> None:
    session = watched(energy=0.052)
    assert spent(-1.0, 0.5, 10, session) is None
    session.check(sample(0.0), 0.0, between)
    assert spent(-1.0, 0.5, 10, session) is None
    session.check(sample(0.0), 0.0, between)
    assert spent(-1.0, 0.5, 11, session) is not None


def test_an_axis_that_nobody_guides_is_held_until_the_button_was_up() -> None:
    session = watched(idle_s=0.095)
    for _ in range(9):
        session.check(sample(0.0), 0.0, State.RESTING)
        assert session.enabled(True)
    session.check(sample(0.0), 0.0, State.RESTING)
    assert session.expired
    assert not session.enabled(True)
    session.check(sample(0.0), 0.0, State.HELD)
    assert not session.enabled(True)  # latched
    assert not session.enabled(False)
    assert session.enabled(True)


@pytest.mark.parametrize("other", [State.GUIDING, State.HELD, State.STOPPING])
def test_only_a_rest_counts_as_idle_and_anew_each_time(other: State) -> None:
    session = watched(idle_s=0.095)
    for _ in range(3):
        for _ in range(9):
            session.check(sample(0.0), 0.0, State.RESTING)
        session.check(sample(0.0), 0.0, other)
    assert not session.expired
    for _ in range(10):
        session.check(sample(0.0), 0.0, State.RESTING)
    assert session.expired
