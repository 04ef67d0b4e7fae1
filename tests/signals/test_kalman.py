"""The filter and smoother against the textbook's joint Gaussian, solved as one dense system."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.signals import kalman

ROWS, TRIALS = 14, 2


def problem(seed: int, both: bool) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.2, 1.0, ROWS))
    first = np.zeros(ROWS, dtype=bool)
    first[[0, 8]] = True
    readings = rng.normal(size=(ROWS, 2))
    variances = rng.uniform(0.1, 0.5, (ROWS, 2))
    variances[3, 0] = 0.0  # a reading that is missing
    if not both:
        variances[:, 1] = 0.0
    jerk = rng.uniform(0.1, 2.0, ROWS)
    return time, readings, variances, first, jerk


def log_likelihood(time, readings, variances, first, jerk) -> float:
    passed = kalman.Passed.blank(len(time))
    kalman.forward(time, readings, variances, first, jerk, passed)
    used = variances > 0
    return -0.5 * float(np.sum((np.log(passed.variance) + passed.surprise)[used]))


def dense(time, readings, variances, first, jerk) -> tuple[np.ndarray, np.ndarray]:
    """Posterior mean and covariance of all states: prior precision of steps plus that of readings."""
    size = 3 * ROWS
    precision, shift = np.zeros((size, size)), np.zeros(size)
    for k in range(ROWS):
        mine = slice(3 * k, 3 * k + 3)
        if first[k]:
            q, w = variances[k]
            mean = np.array([readings[k, 0] if q > 0 else 0.0, readings[k, 1] if w > 0 else 0.0, 0.0])
            fast = 1.0
            if q > 0 and k + 1 < ROWS and not first[k + 1]:
                fast += ((readings[k + 1, 0] - readings[k, 0]) / (time[k + 1] - time[k])) ** 2
            prior = np.linalg.inv(np.diag([9 * q if q > 0 else 1e-12, 9 * w if w > 0 else fast, jerk[k]]))
            precision[mine, mine] += prior
            shift[mine] += prior @ mean
        else:
            h = time[k] - time[k - 1]
            move = np.array([[1, h, h * h / 2], [0, 1, h], [0, 0, 1]])
            loud = jerk[k] * np.array(
                [
                    [h**5 / 20, h**4 / 8, h**3 / 6],
                    [h**4 / 8, h**3 / 3, h**2 / 2],
                    [h**3 / 6, h**2 / 2, h],
                ]
            )
            both = slice(3 * k - 3, 3 * k + 3)
            difference = np.hstack([-move, np.eye(3)])
            precision[both, both] += difference.T @ np.linalg.inv(loud) @ difference
        for j in range(2):
            if variances[k, j] > 0:
                precision[3 * k + j, 3 * k + j] += 1.0 / variances[k, j]
                shift[3 * k + j] += readings[k, j] / variances[k, j]
    covariance = np.linalg.inv(precision)
    return (covariance @ shift).reshape(ROWS, 3), covariance


@pytest.mark.parametrize("both", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_smooths_to_the_posterior(seed: int, both: bool) -> None:
    given = problem(seed, both)
    passed = kalman.Passed.blank(ROWS)
    kalman.forward(*given, passed)
    states, _, _, spread = kalman.backward(given[0], given[2], given[3], passed)
    mean, covariance = dense(*given)
    np.testing.assert_allclose(states, mean, rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(spread, np.diag(covariance).reshape(ROWS, 3)[:, 1:], rtol=1e-7)


@pytest.mark.parametrize("size", [1.0, 1e-7, 1e7], ids=["as it is", "product below all", "and beyond"])
@pytest.mark.parametrize("most", [np.inf, 1.0])
@pytest.mark.parametrize("both", [True, False])
def test_unlikely_is_the_sum_of_what_forward_leaves(both: bool, most: float, size: float) -> None:
    time, readings, variances, first, jerk = problem(3, both)
    given = time, size * readings, size**2 * variances, first, size**2 * jerk
    passed = kalman.Passed.blank(ROWS)
    kalman.forward(*given, passed)
    each = np.minimum(passed.surprise, most) + np.log(passed.variance)
    assert kalman.unlikely(*given, most) == pytest.approx(each[~first].sum(), rel=1e-12)


@pytest.mark.parametrize("both", [True, False])
def test_power_and_share_are_the_slope_of_the_likelihood(both: bool) -> None:
    time, readings, variances, first, jerk = problem(7, both)
    passed = kalman.Passed.blank(ROWS)
    kalman.forward(time, readings, variances, first, jerk, passed)
    _, power, share, _ = kalman.backward(time, variances, first, passed)
    for k in np.flatnonzero(~first):
        louder, quieter = jerk.copy(), jerk.copy()
        louder[k] *= 1.0 + 1e-5
        quieter[k] *= 1.0 - 1e-5
        slope = log_likelihood(time, readings, variances, first, louder)
        slope -= log_likelihood(time, readings, variances, first, quieter)
        assert slope / 2e-5 == pytest.approx(0.5 * jerk[k] * (power[k] - share[k]), rel=1e-4, abs=1e-7)
