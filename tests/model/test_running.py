"""Running medians and means, and the deviation that a median tells, against SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage, stats

from idtool.model.running import deviation, running_mean, running_median


@pytest.mark.parametrize("width", [1, 2, 3, 5, 8, 31])
@pytest.mark.parametrize("rows", [1, 3, 8, 50, 301])
def test_as_scipy(rows: int, width: int) -> None:
    values = np.round(np.random.default_rng(rows).normal(size=rows), 1)  # many are equal
    nearest, constant = (ndimage.median_filter(values, width, mode=mode) for mode in ("nearest", "constant"))
    np.testing.assert_array_equal(running_median(values, width), nearest)
    np.testing.assert_array_equal(running_median(values, width, beyond=0.0), constant)
    mean = ndimage.uniform_filter1d(values, width, mode="nearest")
    np.testing.assert_allclose(running_mean(values, width), mean, atol=1e-12)
    mirrored = ndimage.uniform_filter1d(values, width, mode="reflect")
    np.testing.assert_allclose(running_mean(values, width, mirrored=True), mirrored, atol=1e-12)


def test_no_number_among_them_spoils_no_memory() -> None:
    values = np.arange(20.0)
    values[7] = np.nan
    assert running_median(values, 3)[:5].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_the_deviation_of_a_median_is_that_of_normal_noise() -> None:
    per_median = 1.0 / stats.norm.ppf(0.75)
    assert deviation(np.array([1.0, -1.0, np.nan, 1.0])) == pytest.approx(per_median, rel=1e-4)
    noise = np.random.default_rng(0).normal(scale=0.3, size=20_000)
    assert deviation(np.append(noise, 1e6)) == pytest.approx(0.3, rel=0.02)
    assert deviation(np.empty(0)) == 0.0
