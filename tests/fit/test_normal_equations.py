"""The small least squares of a search against SciPy's, from products of the columns alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import optimize

from idtool.fit.normal_equations import not_negative


@pytest.mark.parametrize("count", [0, 1, 3, 6])
@pytest.mark.parametrize("seed", range(8))
def test_as_bounded_least_squares(seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    columns = random.normal(size=(40, 6)) * 10.0 ** random.uniform(-4, 4, 6)
    shares = random.normal(size=6) / np.linalg.norm(columns, axis=0)
    shares[:count] = np.abs(shares[:count])
    if count:
        shares[random.integers(count)] *= -0.3  # one that would be below zero
    target = columns @ shares + 0.02 * random.normal(size=40)
    both = np.column_stack([target, columns])
    solution = np.zeros(6)
    cost = not_negative(both.T @ both, count, solution)
    low = np.where(np.arange(6) < count, 0.0, -np.inf)
    size = np.linalg.norm(columns, axis=0)
    best = optimize.lsq_linear(columns / size, target, (low, np.inf), tol=1e-12, method="bvls")
    np.testing.assert_allclose(solution * size, best.x, rtol=1e-6, atol=1e-9)
    assert cost == pytest.approx(2.0 * best.cost, rel=1e-6)


@pytest.mark.parametrize("twin", [1.0, -2.0, 0.0], ids=["same", "opposite", "nothing"])
def test_a_column_that_the_others_explain_changes_nothing(twin: float) -> None:
    random = np.random.default_rng(3)
    columns = random.normal(size=(30, 3))
    target = columns @ np.array([1.0, -2.0, 3.0]) + 0.1 * random.normal(size=30)
    one, other = (np.column_stack([target, columns, *more]) for more in ([], [twin * columns[:, 0]]))
    alone, along = np.zeros(3), np.zeros(4)
    cost = not_negative(one.T @ one, 0, alone)
    assert not_negative(other.T @ other, 0, along) == pytest.approx(cost, rel=1e-9)
    assert along[0] + twin * along[3] == pytest.approx(alone[0], rel=1e-9)
    np.testing.assert_allclose(along[1:3], alone[1:], rtol=1e-9)
