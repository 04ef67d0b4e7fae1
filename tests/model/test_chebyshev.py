"""The bends along a stroke against numpy's own Chebyshev polynomials."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Chebyshev

from idtool.model.chebyshev import add_bends, degree_of, place


@given(
    st.floats(-1.0, 1.0),
    st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=7),
)
def test_the_bends_are_a_chebyshev_sum(x: float, numbers: list[float]) -> None:
    total = np.array([1.0, 2.0])
    add_bends(total, 1, x, np.array(numbers), 0)
    assert total[0] == 1.0
    assert total[1] == pytest.approx(2.0 + Chebyshev([0.0, 0.0, *numbers])(x), abs=1e-9)


@pytest.mark.parametrize(("position", "at"), [(0.5, -1.0), (2.0, 0.0), (2.75, 0.5), (9.0, 1.0)])
def test_a_place_is_held_at_the_ends_of_the_stroke(position: float, at: float) -> None:
    assert place(position, 2.0, 1.5) == at


def test_the_degree_is_that_of_the_highest_number_in_a_file() -> None:
    assert degree_of({}, "bend_", 8) == 1
    assert degree_of({"bend_2": 0.0, "bend_5": 1.0}, "bend_", 8) == 5
