"""What beats in time is told from what repeats over the position by speeds, or by ways, that differ."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.effects.external_periodic import ExternalPeriodic
from idtool.model.motion import Array, Motion

TIME = np.linspace(0.0, 20.0, 2000)


@pytest.mark.parametrize(
    ("velocity", "told"),
    [
        (0.3 + 0.02 * np.sin(TIME), False),
        (0.3 + 0.2 * np.sin(TIME), True),
        (0.3 * np.sign(np.sin(TIME)), True),
        (np.zeros(len(TIME)), True),
        (np.where(TIME < 10.0, 1.0, 1.25), False),
        (np.where(TIME < 10.0, 1.0, 1.35), True),
        (np.where(TIME < 3.0, 0.04, 1.0), False),
        (np.where(TIME < 3.0, 0.06, 1.0), True),
    ],
    ids=[
        "one speed one way",
        "speeds",
        "both ways",
        "at rest",
        "alike",
        "a third faster",
        "creeping",
        "slow",
    ],
)
def test_at_one_speed_and_one_way_it_cannot_be_told(velocity: Array, told: bool) -> None:
    position = np.cumsum(velocity) * TIME[1]
    motion = Motion(TIME, np.zeros(len(TIME), dtype=int), position, velocity, np.gradient(velocity, TIME))
    assert (ExternalPeriodic().untestable(motion) is None) is told


def on_clocks(*starts: float) -> Motion:
    """A trial of 20 s from each of these times on, there and back at changing speed."""
    trial = np.repeat(np.arange(len(starts)), len(TIME))
    time = np.concatenate([start + TIME for start in starts])
    velocity = np.tile(np.sin(TIME), len(starts))
    position = np.tile(-np.cos(TIME), len(starts))
    return Motion(time, trial, position, velocity, np.gradient(velocity, TIME[1]))


@pytest.mark.parametrize(
    ("starts", "clocks"),
    [
        ((0.0, 21.0, 42.0), [0, 0, 0]),
        ((42.0, 0.0, 21.0), [0, 0, 0]),
        ((0.0, 0.0, 0.1), [0, 1, 2]),
        ((0.0, 21.0, 0.0, 21.0), [0, 0, 1, 1]),
    ],
    ids=["one that runs on", "the same, in another order", "each its own", "two sessions"],
)
def test_trials_that_overlap_in_time_are_of_several_clocks(
    starts: tuple[float, ...], clocks: list[int]
) -> None:
    motion = on_clocks(*starts)
    assert motion.clock[motion.starts].tolist() == clocks
    assert len(ExternalPeriodic().active(motion)) == 1 + 2 * (max(clocks) + 1)


def test_what_is_known_of_a_clock_is_not_taken_for_another() -> None:
    effect, motion = ExternalPeriodic(), on_clocks(0.0, 0.0, 0.0)
    values = effect.to_values(
        {"frequency": 0.5, "amplitude": 1.0, "phase": 0.0, "amplitude_2": 2.0, "phase_2": 1.0}
    )
    first, second, third = np.split(np.asarray(effect.contribute(motion, values).torque), 3)
    assert first == pytest.approx(np.sin(np.pi * TIME))
    assert second == pytest.approx(2.0 * np.sin(np.pi * TIME + 1.0))
    assert third == pytest.approx(0.0)


def test_more_clocks_than_it_can_have_phases() -> None:
    assert ExternalPeriodic().untestable(on_clocks(*[0.0] * 6)) is None
    assert "starts anew 6 times" in str(ExternalPeriodic().untestable(on_clocks(*[0.0] * 7)))
