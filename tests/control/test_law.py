"""What a law is before it has done anything, and what it shares with every other."""

from __future__ import annotations

import pytest

from idtool.control.guard import Limits, Measurement, State
from idtool.control.law import WORDS, Law
from idtool.control.online import OnlineModel

from .double import BENCH, parameters

RESOLUTION = 0.0015


class Still(Law):
    """Holds the axis where it is, and asks nothing."""

    def reset(self) -> None:
        self.state = State.STARTING

    def begin(self, position: float) -> None:
        self.anchor = position

    def raw_command(self, sample: Measurement) -> float:
        return self.anchor

    def stand(self, position: float) -> None:
        self.anchor = position
        self.rest()

    def rest(self) -> None:
        self.state = State.RESTING


@pytest.fixture
def law() -> Law:
    return Still(OnlineModel(parameters(BENCH)), Limits(), 0.01, RESOLUTION)


def test_a_law_that_asks_nothing_reports_nothing(law: Law) -> None:
    """What `status` shows as friction and uncertainty, and what the guard takes for the hand's torque."""
    assert (law.raw, law.uncertainty, law.extra, law.limited, law.note) == (0.0, 0.0, 0.0, (), "")
    assert law.state is State.STARTING
    assert law.tare() is False


def test_only_a_law_that_rests_is_ready_for_a_hand(law: Law) -> None:
    for state in WORDS:
        law.state = state
        assert law.ready is (state is State.RESTING)


def test_an_axis_rests_below_a_step_of_the_sensor_in_three_periods_of_ten_milliseconds(law: Law) -> None:
    assert law.rest_speed == pytest.approx(RESOLUTION / 0.03, rel=0.011)


def test_every_state_but_a_fault_has_words() -> None:
    assert set(WORDS) == set(State) - {State.FAULT}
