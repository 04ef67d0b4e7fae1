"""What beats in time is told from what repeats over the position by speeds, or by ways, that differ."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.effects.external_periodic import ExternalPeriodic
from idtool.model.motion import Array, Motion

TIME = np.linspace(0.0, 20.0, 2000)


@pytest.mark.parametrize(
    ("velocity", "told"),
    [
        (0.3 + 0.02 * np.sin(TIME), False),
        (0.3 + 0.2 * np.sin(TIME), True),
        (0.3 * np.sign(np.sin(TIME)), True),
        (np.zeros(len(TIME)), True),
    ],
    ids=["one speed one way", "speeds", "both ways", "at rest"],
)
def test_at_one_speed_and_one_way_it_cannot_be_told(velocity: Array, told: bool) -> None:
    position = np.cumsum(velocity) * TIME[1]
    motion = Motion(TIME, np.zeros(len(TIME), dtype=int), position, velocity, np.gradient(velocity, TIME))
    assert (ExternalPeriodic().untestable(motion) is None) is told
