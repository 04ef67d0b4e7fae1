"""What is told of a motion."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.model.motion import Motion, since_reversal


def test_travel_counts_from_the_last_reversal() -> None:
    position, velocity = np.array([0.0, 1.0, 2.0, 1.0, 0.0, 5.0, 6.0]), np.array([1.0, 1, 1, -1, -1, 1, 1])
    trial = np.array([0, 0, 0, 0, 0, 1, 1])
    np.testing.assert_allclose(since_reversal(position, velocity, trial), [0, 1, 2, 0, 1, 0, 1])


def test_what_is_typical_of_rows_is_their_median_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing = np.zeros(6)
    motion = Motion(
        nothing, np.zeros(6, np.intp), nothing, nothing, nothing, payload=np.array([1.0, 2, 9, 4, 5, 6])
    )
    asked = []
    median = np.median
    monkeypatch.setattr(np, "median", lambda values: asked.append(1) or median(values))
    assert [motion.typical("payload", rows) for rows in (slice(0, 3), slice(3, 6), slice(0, 3))] == [2, 5, 2]
    assert len(asked) == 2
    assert motion.typical("temperature", slice(0, 3)) is None
