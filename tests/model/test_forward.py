"""The integration of an axis: what stands below break-away stands exactly."""

from __future__ import annotations

import numpy as np

from idtool.model import forward


def test_an_axis_below_break_away_stands_exactly() -> None:
    numbers = np.zeros(forward.NUMBERS)
    numbers[[forward.INERTIA, forward.COULOMB, forward.STATIC, forward.STRIBECK]] = 0.01, 0.1, 0.15, 0.05
    numbers[forward.EXPONENT], numbers[forward.POSITION_STEP] = 2.0, 1.0
    numbers[[forward.FIRST_POSITION, forward.VELOCITY_STEP]] = -5.0, 1.0
    plant = forward.Plant(numbers, np.zeros((2 * forward.FIELDS, 11)), np.zeros(2))
    clock = np.arange(0.0, 4.0, 0.01)
    torque = np.where(clock < 0.2, 0.6, 0.14 * np.sin(20.0 * clock))  # a push, then below break-away
    rest = np.zeros(len(clock))
    path = forward.simulate(
        plant, clock, torque, rest + 1.0, rest + 1.0, rest, (0.0, 0.0, 0.0), by_goal=False
    )
    last = path[clock > 3.0]
    assert path[clock < 0.2, 1].max() > 1.0
    assert (last[:, 1] == 0.0).all()
    assert np.ptp(last[:, 0]) == 0.0
