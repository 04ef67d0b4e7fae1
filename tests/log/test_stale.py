"""Readings that stayed while the axis went on: told however few, and no rest is taken for them."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.log.stale import frozen, stale

ROWS = 4000


def swing(step: float = 1e-4) -> np.ndarray:
    """Position at up to 0.4 rad/s and 200 rows a second, in steps of the sensor."""
    return step * np.round(0.2 * np.sin(0.01 * np.arange(ROWS)) / step)


def found(position: np.ndarray) -> np.ndarray:
    return stale(np.arange(len(position)) == 0, position)


@pytest.mark.parametrize(("rows", "told"), [(5, True), (12, True), (40, True), (1, False)])
def test_a_burst_is_told_however_short(rows: int, told: bool) -> None:
    position, there = swing(), np.zeros(ROWS, dtype=bool)
    for begin in (300, 1250, 2800, 3150):  # mid-way
        position[begin : begin + rows + 1] = position[begin]
        there[begin + 1 : begin + rows + 1] = True
    assert (found(position) == (there & told)).all()


@pytest.mark.parametrize("elsewhere", [True, False])
def test_a_burst_beside_a_reversal_is_told_where_others_are_plain(elsewhere: bool) -> None:
    """The axis turns round at row 471, and goes 20 steps of the sensor meanwhile."""
    position = swing()
    position[465:486] = position[465]
    if elsewhere:
        position[1250:1271] = position[1250]
    assert found(position)[466:486].all() == elsewhere


def test_an_axis_that_was_held_and_let_go_is_no_sensor_that_stays() -> None:
    """It goes on from where it stood."""
    position = np.concatenate([swing()[:2800], np.full(30, swing()[2800]), swing()[2800:]])
    assert not found(position).any()


def test_a_coarse_sensor_repeats_itself() -> None:
    assert not found(swing(2e-3)).any()


def test_a_sensor_that_is_read_every_fourth_row_is_as_it_always_is() -> None:
    assert not found(np.repeat(swing()[::4], 4)).any()


def of_noise(grain: float, seed: int = 0) -> np.ndarray:
    """An effort with noise of 1, in steps of a sensor."""
    return grain * np.round((10.0 * np.cos(0.01 * np.arange(ROWS)) + noise(seed)) / grain)


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=ROWS)


@pytest.mark.parametrize(("grain", "rows"), [(0.01, 6), (0.01, 300), (1.0, 30), (2.0, 200)])
def test_an_effort_that_stays_while_the_axis_moves_is_told(grain: float, rows: int) -> None:
    effort, there = of_noise(grain), np.zeros(ROWS, dtype=bool)
    for begin in (300, 2800):  # half-way up
        effort[begin : begin + rows + 1] = effort[begin]
        there[begin + 1 : begin + rows + 1] = True
    told = frozen(np.arange(ROWS) == 0, swing(), effort)
    assert (told[there]).all()
    assert np.count_nonzero(told & ~there) <= 6  # what happens to be read again at the ends


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("grain", [0.01, 1.0, 4.0])
def test_an_effort_of_coarse_steps_repeats_itself(grain: float, seed: int) -> None:
    assert not frozen(np.arange(ROWS) == 0, swing(), of_noise(grain, seed)).any()


def ramps(level: float) -> np.ndarray:
    """Noise, and one stretch of a level that something else than a reading may keep."""
    effort = of_noise(0.01)
    effort[300:600] = level
    return effort


@pytest.mark.parametrize(
    "effort",
    [
        ramps(0.0),
        ramps(float(of_noise(0.01).max()) + 1.0),
    ],
    ids=["drive off", "saturated"],
)
def test_an_effort_that_may_stay_is_left_alone(effort: np.ndarray) -> None:
    assert not frozen(np.arange(ROWS) == 0, swing(), effort).any()


def test_an_effort_that_holds_an_axis_is_left_alone() -> None:
    effort, position = of_noise(0.01), swing()
    effort[300:600], position[300:600] = 3.0, position[300]
    assert not frozen(np.arange(ROWS) == 0, position, effort).any()
