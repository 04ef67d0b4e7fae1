"""What is told of a motion."""

from __future__ import annotations

import numpy as np

from idtool.model.motion import since_reversal


def test_travel_counts_from_the_last_reversal() -> None:
    position, velocity = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 5.0, 6.0]), np.array([1.0, 1, 1, -1, -1, 1, 1])
    trial = np.array([0, 0, 0, 0, 0, 1, 1])
    np.testing.assert_allclose(since_reversal(position, velocity, trial), [0, 1, 2, 0, 1, 0, 1])
