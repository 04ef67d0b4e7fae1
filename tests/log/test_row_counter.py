"""Rows lost while a counter went on: told where they are, and nothing else is taken for them."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.log.row_counter import lost_rows

ROWS = 6000


def swings(seed: int, share: float, noise: float = 3e-5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time of a row counter, position of swings at up to 0.4 rad/s in steps of 1e-4, and rows lost before."""
    chance = np.random.default_rng(seed)
    kept = np.flatnonzero(np.append(True, chance.uniform(size=ROWS - 1) > share))
    true = 0.005 * kept
    position = 0.2 * np.sin(2.0 * true) + 0.1 * np.sin(0.7 * true) + chance.normal(0.0, noise, len(kept))
    return 0.005 * np.arange(len(kept)), np.round(position, 4), np.diff(kept, prepend=-1) - 1


def found(time: np.ndarray, position: np.ndarray) -> np.ndarray:
    return lost_rows(time, time == 0.0, position)


@pytest.mark.parametrize(("share", "told"), [(0.01, 0.8), (0.03, 0.8), (0.1, 0.75)])
@pytest.mark.parametrize("seed", range(3))
def test_lost_rows_are_told_where_they_are(seed: int, share: float, told: float) -> None:
    """... but for those near standstill, which do not matter."""
    time, position, lost = swings(seed, share)
    rows = found(time, position)
    assert rows.sum() > told * lost.sum()
    assert np.count_nonzero(rows > lost) <= 0.01 * lost.sum()


def test_a_clock_that_tells_the_gaps_is_believed() -> None:
    time, position, lost = swings(0, 0.03)
    assert found(time, position).any()
    assert not found(time + 0.005 * np.cumsum(lost), position).any()


def test_nothing_is_lost_of_a_whole_recording() -> None:
    time, position, _ = swings(0, 0.0)
    assert not found(time, position).any()


def test_rows_that_changed_places_are_not_lost() -> None:
    time, position, _ = swings(0, 0.0)
    for row in range(50, ROWS - 50, 90):
        position[[row, row + 1]] = position[[row + 1, row]]
    assert not found(time, position).any()


def test_a_reading_that_comes_a_row_late_is_no_loss() -> None:
    """The axis seems to stand for a row, and then goes two ways at once."""
    time, position, _ = swings(0, 0.0)
    late = np.arange(50, ROWS - 50, 90)
    position[late] = position[late - 1]
    assert not found(time, position).any()


@pytest.mark.parametrize(("losses", "told"), [(13, 0), (14, 14)])
def test_fourteen_losses_in_the_faster_half_are_no_chance(losses: int, told: int) -> None:
    way = np.where(np.arange(4000) < 2000, 1.0, 2.0)
    position = 1e-3 * np.cumsum(way) + 2e-6 * np.random.default_rng(0).normal(size=4000)
    position = np.delete(position, 2000 + 100 * np.arange(1, losses + 1))
    assert found(0.01 * np.arange(len(position)), position).sum() == told


def test_bursts_of_a_slow_motion_are_no_losses() -> None:
    """Twice as fast for a row, but in the slower half alone."""
    way = np.where(np.arange(4000) < 2000, 1.0, 2.0)
    way[100:2000:50] *= 2.0
    position = 1e-3 * np.cumsum(way) + 2e-6 * np.random.default_rng(0).normal(size=4000)
    assert not found(0.01 * np.arange(4000), position).any()
