"""Faults of sensors told from the readings alone: where the lines are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from idtool.log.sensor_faults import clipped, repeated, resolution, stuck, unwrap

TURN = 2.0 * math.pi


def unwrapped(turns: np.ndarray) -> tuple[np.ndarray, int]:
    """What becomes of a way in turns that a sensor of one turn reads."""
    first = np.arange(len(turns)) == 0
    way, wraps = unwrap(TURN * (turns % 1.0), first)
    return way / TURN, wraps


@pytest.mark.parametrize(("step", "wraps"), [(0.18, 17), (0.25, 0)])
def test_a_step_of_a_fifth_of_a_turn_can_be_told_from_a_wrap(step: float, wraps: int) -> None:
    way = step * np.arange(100)
    found, count = unwrapped(way)
    assert count == wraps
    if wraps:
        np.testing.assert_allclose(found, way, atol=1e-9)


@pytest.mark.parametrize(("range_turns", "wraps"), [(1.008, 9), (1.012, 0)])
def test_a_range_that_is_no_whole_turn_is_no_angle(range_turns: float, wraps: int) -> None:
    """A hundredth of a turn is what the motion of a step may differ by; who knows what the rest is."""
    reading = TURN * (0.05 * np.arange(200) % range_turns)
    assert unwrap(reading, np.arange(200) == 0)[1] == wraps


@pytest.mark.parametrize(("jump", "wraps"), [(0.055, 3), (0.065, 2)])
def test_a_reading_that_is_off_by_about_a_turn_does_not_wrap(jump: float, wraps: int) -> None:
    way = 0.01 * np.arange(350)
    way[200:] += jump - 0.01  # where it wraps for the second time
    assert np.floor(way[200]) - np.floor(way[199]) == 1.0
    assert unwrapped(way)[1] == wraps


def strokes(times: int, held: int, same: bool = False) -> np.ndarray:
    """So many ways up to a limit, at which the reading stays for `held` rows."""
    chance = np.random.default_rng(0)
    up = np.sort(chance.uniform(0.0, 0.99, 40))
    ways = [up if same else np.sort(chance.uniform(0.0, 0.99, 40)) for _ in range(times)]
    return np.concatenate([np.concatenate([way, np.ones(held)]) for way in ways])


@pytest.mark.parametrize(
    ("times", "held", "is_clipped"), [(4, 3, True), (6, 2, False), (3, 3, False), (5, 2, False)]
)
def test_three_rows_at_a_time_and_ten_in_all_are_a_limit(times: int, held: int, is_clipped: bool) -> None:
    values = strokes(times, held)
    assert clipped(values)[values == 1.0].all() == is_clipped
    assert not clipped(values)[values < 0.9].any()


@pytest.mark.parametrize(("held", "is_clipped"), [(3, False), (4, True)])
def test_a_limit_piles_up_three_times_what_lies_below(held: int, is_clipped: bool) -> None:
    """The peak of a sine without noise does 2.4 times; here each value below comes four times."""
    values = strokes(4, held, same=True)
    assert clipped(values)[values == 1.0].all() == is_clipped


@pytest.mark.parametrize(("rows", "long"), [(19, False), (20, True)])
def test_twenty_equal_readings_can_be_a_stuck_sensor(rows: int, long: bool) -> None:
    values = np.concatenate([np.arange(50.0), np.full(rows - 1, 49.0), np.arange(50.0, 90.0)])
    found = repeated(values, np.arange(len(values)) == 0)
    assert np.count_nonzero(found) == (rows if long else 0)


def test_the_smallest_step_is_none_that_rounding_makes() -> None:
    values = 0.001 * np.round(np.cumsum(np.random.default_rng(0).normal(size=500)))
    values[::7] += 1e-16
    assert resolution(values) == pytest.approx(0.001)
    assert resolution(np.append(values, 1e30)) == pytest.approx(0.001)
    assert resolution(None) == resolution(np.ones(5)) == 0.0


def position_is_stuck(speed: float, rows: int, grain: float = 1e-6) -> bool:
    """Whether a position that repeats itself for so many rows is at fault, while a speed is read there.

    Before, the axis goes to and fro over 2 rad at up to 1 rad/s.
    """
    swing = 0.01 * np.arange(629)
    way = np.concatenate([1.0 - np.cos(swing), np.zeros(rows)])
    position = grain * np.round(way / grain)
    little = 1.0 + 1e-3 * (-1.0) ** np.arange(rows)
    velocity = np.concatenate([np.sin(swing), speed * little])
    time = 0.01 * np.arange(len(way))
    by_position, by_velocity = stuck(time, position, velocity, time == 0.0)
    assert not by_velocity.any()
    return bool(by_position[-rows + 2 :].all())


@pytest.mark.parametrize(("away", "is_stuck"), [(0.037, False), (0.055, True)])
def test_a_fiftieth_of_the_stroke_is_no_disagreement(away: float, is_stuck: bool) -> None:
    assert position_is_stuck(away / 0.3, 30) == is_stuck


@pytest.mark.parametrize(("away", "is_stuck"), [(0.048, False), (0.068, True)])
def test_five_steps_of_the_position_are_none(away: float, is_stuck: bool) -> None:
    assert position_is_stuck(away / 0.3, 30, grain=0.01) == is_stuck


@pytest.mark.parametrize(("speed", "is_stuck"), [(0.017, False), (0.027, True)])
def test_a_fiftieth_of_the_top_speed_may_be_read_at_rest(speed: float, is_stuck: bool) -> None:
    assert position_is_stuck(speed, 500) == is_stuck


@pytest.mark.parametrize(("share", "is_stuck"), [(0.27, False), (0.4, True)])
def test_three_tenths_of_the_way_are_no_stuck_speed(share: float, is_stuck: bool) -> None:
    """A speed that repeats itself, and a position that moves on more slowly by this share."""
    speed = np.concatenate([np.sin(0.01 * np.arange(158)), np.ones(100), np.cos(0.01 * np.arange(1, 158))])
    true = np.where((np.arange(len(speed)) >= 158) & (np.arange(len(speed)) < 258), 1.0 - share, speed)
    time = 0.01 * np.arange(len(speed))
    position = np.cumsum(true) * 0.01
    by_position, by_velocity = stuck(time, position, speed, time == 0.0)
    assert not by_position.any()
    assert by_velocity[160:257].all() == is_stuck


def test_a_reading_that_rests_at_zero_is_at_no_limit() -> None:
    """A current without its sign, of a servo that mostly stands."""
    pulse = np.r_[np.zeros(30), 0.07, 0.13, 0.25, 0.15, 0.06]
    assert not clipped(np.tile(pulse, 4)).any()
    assert clipped(np.tile(pulse + 0.5, 4)).any()


@pytest.mark.parametrize(("below", "is_clipped"), [(5, False), (6, True)])
def test_a_limit_is_compared_with_the_five_values_below_it(below: int, is_clipped: bool) -> None:
    """Eight further ways end so many values below the limit, each of which comes twelve times then."""
    way = strokes(1, 0)
    values = np.concatenate([strokes(4, 4, same=True), *[way[: len(way) - below + 1]] * 8])
    assert clipped(values)[values == 1.0].all() == is_clipped
