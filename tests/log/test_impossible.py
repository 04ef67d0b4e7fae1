"""How long a fault may last to be seen."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.log.impossible import beyond, find, stamps


@pytest.mark.parametrize(("rows", "seen"), [(3, True), (4, False)])
def test_a_fault_of_up_to_half_the_median_is_seen(rows: int, seen: bool) -> None:
    values = np.sin(0.01 * np.arange(400))
    values[200 : 200 + rows] += 5.0
    found = beyond(values, np.arange(400) == 0)
    assert np.flatnonzero(found).tolist() == (list(range(200, 200 + rows)) if seen else [])


def test_time_stamps_that_are_off_for_fifteen_rows() -> None:
    """The position goes on as the even clock does."""
    even = 0.01 * np.arange(400)
    time = even.copy()
    time[200:215] = np.linspace(even[214] - 0.015, even[214] + 0.004, 15)
    odd, mended = stamps(time, np.arange(400) == 0, np.sin(3.0 * even))
    assert np.flatnonzero(odd).min() == 200
    np.testing.assert_allclose(mended, even, atol=0.02)


def _brisk_after_slow(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time, position and speed of slow waves and then brisk moves of a hand: the drive reports the speed
    through a filter of 7 ms, and the clock jitters by a hundredth of a row."""
    rng = np.random.default_rng(seed)
    fine = np.arange(0.0, 80.0, 1e-3)
    position = np.where(fine < 60.0, 1.2 * np.sin(0.6 * fine), 0.0)
    position[fine >= 60.0] = position[fine < 60.0][-1]
    begin = 60.0
    while begin < 79.0:
        lasts = rng.uniform(0.3, 1.5)
        share = np.clip((fine - begin) / lasts, 0.0, 1.0)
        position += rng.uniform(-0.5, 0.5) * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
        begin += lasts + rng.uniform(0.0, 0.5)
    late = np.exp(-np.arange(0.0, 0.05, 1e-3) / 0.007)
    speed = np.convolve(np.gradient(position, 1e-3), late / late.sum())[: len(fine)]
    time = 0.008 * np.arange(1, 9900) + rng.normal(0.0, 8e-5, 9899)
    return time, np.round(np.interp(time, fine, position), 6), np.interp(time, fine, speed)


@pytest.mark.parametrize("seed", range(8))
def test_a_brisk_move_after_slow_ones_is_possible(seed: int) -> None:
    """... though a speed that is read late denies it; one row that is off among the slow ones is not."""
    time, position, speed = _brisk_after_slow(seed)
    first = np.arange(len(time)) == 0
    found = find(time, first, position, speed, np.sin(time))
    assert not found.slips
    assert not (found.position | found.velocity | found.effort).any()
    position[3000] += 0.02
    assert np.flatnonzero(find(time, first, position, speed, np.sin(time)).position).tolist() == [3000]
