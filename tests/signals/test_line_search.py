"""Brent's bounded search: the points of SciPy's, and what it promises."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import optimize

from idtool.signals.line_search import lowest


@given(
    seed=st.integers(0, 10_000),
    low=st.floats(-50.0, 50.0),
    width=st.floats(1e-3, 50.0),
    tolerance=st.sampled_from([1e-5, 1e-3, 0.1]),
)
def test_every_point_is_scipy_s(seed: int, low: float, width: float, tolerance: float) -> None:
    """On curves with one valley, several, kinks and flats."""
    a, b, c, d = np.random.default_rng(seed).uniform(-1.0, 1.0, 4)

    def cost(x: float) -> float:
        t = (x - low) / width
        return (t - a) ** 2 + 0.3 * b * math.sin(9.0 * t) + max(c, abs(t - 0.5 * d)) + round(b * t)

    mine: list[float] = []
    theirs: list[float] = []
    found = lowest(lambda x: (mine.append(x), cost(x))[1], low, low + width, tolerance)
    expected = optimize.minimize_scalar(
        lambda x: (theirs.append(x), cost(x))[1],
        bounds=(low, low + width),
        method="bounded",
        options={"xatol": tolerance},
    )
    assert found == expected.x
    assert mine == theirs


@pytest.mark.parametrize("at", [-0.999, 0.2, 0.75, 1.001])
def test_a_valley_inside_and_at_an_end(at: float) -> None:
    assert lowest(lambda x: (x - at) ** 4, -1.0, 1.0, 1e-4) == pytest.approx(at, abs=5e-3)


def test_few_evaluations_on_a_smooth_valley() -> None:
    asked: list[float] = []
    lowest(lambda x: (asked.append(x), (x - 3.0) ** 2 + 0.01 * x**3)[1], -5.0, 9.0, 0.1)
    assert len(asked) < 10
