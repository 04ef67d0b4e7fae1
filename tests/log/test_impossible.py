"""How long a fault may last to be seen."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.log.impossible import beyond, stamps


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
