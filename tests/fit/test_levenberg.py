"""Bounded least squares against SciPy's, and what it promises at bounds and limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import optimize

from idtool.fit.levenberg import minimise
from idtool.fit.outcome import Outcome
from idtool.model.motion import Array

OPEN = np.full(2, np.inf)


def rosenbrock(x: Array) -> Array:
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def its_jacobian(x: Array) -> Array:
    return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


def test_a_curved_valley() -> None:
    found = minimise(rosenbrock, its_jacobian, np.array([-1.2, 1.0]), -OPEN, OPEN, most=100)
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=1e-6)
    assert found.outcome is Outcome.CONVERGED


def test_out_of_evaluations() -> None:
    found = minimise(rosenbrock, its_jacobian, np.array([-1.2, 1.0]), -OPEN, OPEN, most=4)
    assert found.outcome is Outcome.OUT_OF_EVALUATIONS
    assert found.evaluations == 4
    assert np.sum(rosenbrock(found.x) ** 2) <= np.sum(rosenbrock(np.array([-1.2, 1.0])) ** 2)


@example(seed=550, size=4, scale=0.6875)
@given(seed=st.integers(0, 10_000), size=st.integers(1, 6), scale=st.floats(-6.0, 6.0))
def test_linear_problems_in_a_box_as_scipy_solves_them(seed: int, size: int, scale: float) -> None:
    """Whatever the units of a coordinate, and however many of them end at a bound."""
    draw = np.random.default_rng(seed)
    matrix = draw.standard_normal((4 * size, size)) * 10.0 ** (scale * draw.uniform(-1.0, 1.0, size))
    target = draw.standard_normal(4 * size)
    width = np.abs(np.linalg.lstsq(matrix, target)[0]) * draw.uniform(0.3, 3.0, size) + 1e-9
    best = optimize.lsq_linear(matrix, target, (-width, width), tol=1e-12, method="bvls")
    found = minimise(lambda x: matrix @ x - target, lambda x: matrix, np.zeros(size), -width, width, most=60)
    assert np.all(np.abs(found.x) <= width)
    assert np.sum((matrix @ found.x - target) ** 2) <= 2.0 * best.cost * (1.0 + 1e-6) + 1e-12


def test_a_start_outside_is_moved_in() -> None:
    low, high = np.array([0.0, 0.0]), np.array([0.5, 2.0])
    found = minimise(rosenbrock, its_jacobian, np.array([9.0, -9.0]), low, high, most=100)
    np.testing.assert_allclose(found.x, [0.5, 0.25], atol=1e-6)
    assert found.outcome is Outcome.AT_BOUND


def test_a_wrong_slope_is_a_stall() -> None:
    """Every step that the slope promises something of makes it worse."""
    found = minimise(
        lambda x: x - 3.0, lambda x: np.array([[-1.0]]), np.zeros(1), -OPEN[:1], OPEN[:1], most=200
    )
    assert found.outcome is Outcome.STALLED


def test_a_coordinate_that_no_row_shows_stays() -> None:
    found = minimise(
        lambda x: x[:1] - 3.0, lambda x: np.array([[1.0, 0.0]]), np.array([0.0, 7.0]), -OPEN, OPEN, most=20
    )
    assert found.x == pytest.approx([3.0, 7.0])


def test_no_step_goes_beyond_its_reach() -> None:
    tried: list[Array] = []

    def residual(x: Array) -> Array:
        tried.append(x.copy())
        return rosenbrock(x)

    reach = np.array([0.1, 0.4])
    start = np.array([-1.2, 1.0])
    found = minimise(residual, its_jacobian, start, -OPEN, OPEN, most=200, reach=reach)
    np.testing.assert_allclose(found.x, [1.0, 1.0], atol=1e-6)
    assert found.cost == np.sum(rosenbrock(found.x) ** 2)
    accepted = [start]
    for one in tried[1:]:
        assert np.all(np.abs(one - accepted[-1]) <= reach * (1.0 + 1e-12))
        if np.sum(rosenbrock(one) ** 2) < np.sum(rosenbrock(accepted[-1]) ** 2):
            accepted.append(one)


def test_a_step_that_failed_corrects_the_slope_along_it() -> None:
    """Steps on the way down a slope of stairs, of whose derivative nothing is seen but the treads'."""

    def stairs(x: Array) -> Array:
        return np.array([np.round(20.0 * x[0]) / 20.0 - 0.5 * (x[0] - 3.0), x[1] - x[0]])

    def treads(x: Array) -> Array:
        return np.array([[-0.5, 0.0], [-1.0, 1.0]])

    plain, learnt = (
        minimise(stairs, treads, np.array([2.03, 0.0]), -OPEN, OPEN, most=80, secant=secant)
        for secant in (False, True)
    )
    assert learnt.cost < 0.1 * plain.cost
