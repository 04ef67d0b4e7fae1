"""Tails of distributions against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special

from idtool.fit.chance import KOLMOGOROV_95, f_tail, gamma_tail, kolmogorov_tail, student_quantile


@pytest.mark.parametrize("share", [0.95, 0.975])
def test_student(share: float) -> None:
    degrees = np.array([1.0, 1.3, 2.0, 2.7, 5.0, 17.3, 100.0, 1e3, 4e4, 1e6])
    np.testing.assert_allclose(student_quantile(degrees, share), special.stdtrit(degrees, share), rtol=2e-9)
    assert student_quantile(np.empty(0), share).shape == (0,)


@pytest.mark.parametrize("value", [0.0, 1e-3, 0.3, 1.0, 4.0, 30.0])
@pytest.mark.parametrize("second", [0.2, 3.0, 40.0, 5e3])
@pytest.mark.parametrize("first", [1, 2, 7, 40])
def test_f(first: int, second: float, value: float) -> None:
    expected = special.fdtrc(first, second, value)
    assert f_tail(first, second, value) == pytest.approx(expected, rel=1e-9, abs=1e-250)


@pytest.mark.parametrize("count", [1, 2, 5, 40, 300, 2000])
def test_gamma(count: int) -> None:
    for value in count * np.array([0.0, 0.01, 0.5, 1.0, 1.5, 3.0, 10.0]):
        assert gamma_tail(count, value) == pytest.approx(special.gammaincc(count, value), rel=1e-10)


def test_kolmogorov() -> None:
    for distance in np.linspace(0.0, 6.0, 121):
        assert kolmogorov_tail(distance) == pytest.approx(special.kolmogorov(distance), rel=1e-12, abs=1e-300)
    assert pytest.approx(special.kolmogi(0.05), rel=1e-15) == KOLMOGOROV_95
