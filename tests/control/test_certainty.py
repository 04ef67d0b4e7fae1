"""The filter of what the model leaves open, against batch regression."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from idtool.control.certainty import Certainty

PRIOR = (0.04, 0.2, 0.2, 0.05)


def test_agrees_with_batch_least_squares() -> None:
    """Recursion and the closed form of Bayesian linear regression are the same thing."""
    rng = np.random.default_rng(0)
    rows = np.column_stack([np.ones(50), rng.normal(size=(50, 2)) * 0.1, np.ones(50)])
    left = rows @ [0.02, 0.1, -0.2, 0.01] + 0.005 * rng.normal(size=50)
    known = Certainty(*PRIOR)
    for row, value in zip(rows, left, strict=True):
        known.learn(value, row[1], row[2], 0.005)
    precision = np.diag(1.0 / np.square(PRIOR)) + rows.T @ rows / 0.005**2
    mean = np.linalg.solve(precision, rows.T @ left / 0.005**2)
    np.testing.assert_allclose(known.mean, mean, rtol=1e-6, atol=1e-9)
    probe = np.array([1.0, 0.07, -0.03, 1.0])
    assert known.correction(0.07, -0.03) == pytest.approx(probe @ mean)
    wanted = np.sqrt(probe @ np.linalg.solve(precision, probe))
    assert known.deviation(0.07, -0.03) == pytest.approx(wanted, rel=1e-6)


def test_travel_tells_a_load_from_a_bristle() -> None:
    """What was heard at rest stays certain in sum; once the bristle has bent over, half of it is not."""
    known = Certainty(0.04, 0.0, 0.0, 0.04)
    known.learn(0.03, 0.0, 0.0, 1e-4)
    assert known.correction(0.0, 0.0) == pytest.approx(0.03, rel=1e-3)
    assert known.deviation(0.0, 0.0) < 2e-4
    known.fade(0.0)
    assert known.correction(0.0, 0.0) == pytest.approx(0.015, rel=1e-3)
    assert known.deviation(0.0, 0.0) == pytest.approx(0.04 / np.sqrt(2.0), rel=1e-3)


@settings(max_examples=200)
@given(
    st.lists(
        st.tuples(
            st.floats(-1.0, 1.0),
            st.floats(-0.3, 0.3),
            st.floats(-0.3, 0.3),
            st.floats(1e-4, 0.1),
            st.floats(0, 1),
        ),
        max_size=60,
    )
)
def test_never_less_certain_than_the_prior_nor_more_than_certain(
    rows: list[tuple[float, float, float, float, float]],
) -> None:
    known = Certainty(*PRIOR)
    first = Certainty(*PRIOR)
    for left, elastic, damping, noise, share in rows:
        known.fade(share)
        known.learn(left, elastic, damping, noise)
        deviation = known.deviation(elastic, damping)
        assert 0.0 <= deviation <= noise * (1.0 + 1e-6) or deviation <= first.deviation(elastic, damping)
        assert np.isfinite(known.mean).all()
