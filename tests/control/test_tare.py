"""The tare: whether a hand was in it, and its least squares."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.control.admittance import tare
from testbench.guided_axes.cases import corner
from testbench.guided_axes.pushes import GAINS, after_tare


@pytest.mark.parametrize("axis", ["paper", "bench"])
@pytest.mark.parametrize("begin", [0.1, 1.0, 1.7, 2.5])
def test_a_light_touch_is_found(axis: str, begin: float) -> None:
    """1 N for 0.4 s: less than the friction that the axis overcomes meanwhile."""
    case = replace(corner(axis, GAINS, (1, -1, 1), stiff=True, delay=0.01, late=True), seed=int(10 * begin))
    for newton in (-1.0, 1.0):
        assert "disturbed" in " ".join(after_tare(case, newton, begin, 0.4).status.notes)
    assert not any("is not used" in note for note in after_tare(case, 0.0, begin, 0.4).status.notes)


def test_inverts_what_a_tare_gathers() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        rows = rng.normal(size=(30, 4))
        a = np.eye(4) + rows.T @ rows
        inverse = a.copy()
        tare.invert(inverse)
        np.testing.assert_allclose(inverse @ a, np.eye(4), atol=1e-10)
