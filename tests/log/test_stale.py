"""Readings that stayed while the axis went on: told however few, and no rest is taken for them."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.log.stale import stale

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
