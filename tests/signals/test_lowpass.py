"""The spectrum that decides how wide the low-pass is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from idtool.signals import lowpass


@pytest.mark.parametrize(("rows", "segment"), [(400, 64), (77, 77), (300, 65)])
def test_the_power_density_is_scipy_s(rows: int, segment: int) -> None:
    values = np.random.default_rng(4).normal(size=rows) + 0.02 * np.arange(rows)
    frequency, pieces = lowpass.power_densities(values, 200.0, segment)
    power = pieces.mean(axis=0)
    theirs = signal.welch(values, 200.0, nperseg=segment, detrend="linear")
    np.testing.assert_allclose(frequency, theirs[0], rtol=1e-12)
    np.testing.assert_allclose(power, theirs[1], rtol=1e-9)
