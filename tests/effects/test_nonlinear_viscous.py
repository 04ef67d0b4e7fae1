"""Drag that grows with the square of speed, as far as speeds were seen."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.control.load import Instant
from idtool.control.online import OnlineModel
from idtool.effects.nonlinear_viscous import NonlinearViscous
from idtool.model.motion import Motion
from tests.control.double import BENCH, parameters


def drag(velocity: float, **values: float) -> float:
    """What the effect adds at that speed, N m."""
    file = parameters(BENCH, nonlinear_viscous=values)
    return OnlineModel(file).update(Instant(0.01, 0.01, 0.0, velocity)).effects


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_beyond_the_fastest_speed_no_parabola_is_extrapolated(sign: float) -> None:
    """0.1 N m s^2/rad^2 over 0.6 rad/s are 0.036 N m; at 2 rad/s it is 0.12 and not 0.4."""
    slow, fast = (drag(sign * w, quadratic=0.1, fastest=0.6) for w in (0.6, 2.0))
    assert slow == pytest.approx(sign * 0.036)
    assert fast == pytest.approx(sign * 0.12)
    assert drag(sign * 2.0, quadratic=0.1) == pytest.approx(sign * 0.4)  # a file that does not say


def test_one_bad_row_is_no_speed_that_was_moved() -> None:
    time = 0.01 * np.arange(6000)
    velocity = 0.5 * np.sin(2.0 * np.pi * time / 4.0)
    velocity[1234] = -30.0
    motion = Motion(
        time, np.zeros(6000, np.intp), np.cumsum(velocity) * 0.01, velocity, np.gradient(velocity, 0.01)
    )
    assert NonlinearViscous().constants(motion) == {"fastest": pytest.approx(0.5, rel=1e-3)}
