"""Backlash: when a load holds the gap closed on some rows and not on others."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.effects import registry
from idtool.model.motion import Motion

TIME = 0.01 * np.arange(1000)


def carrying(load: np.ndarray | None) -> Motion:
    trial = np.zeros(1000, dtype=np.intp)
    return Motion(TIME, trial, np.sin(TIME), np.cos(TIME), -np.sin(TIME), load=load)


@pytest.mark.parametrize(
    ("loaded", "rest", "tells"),
    [
        (0.1, 0.08, True),
        (0.1, 0.12, False),  # that is a load as well: no row is without
        (0.04, 0.0, False),  # on too few rows
        (0.96, 0.0, False),  # on all but too few
        (0.0, 0.0, False),
    ],
)
def test_a_load_counts_above_a_tenth_of_the_largest(loaded: float, rest: float, tells: bool) -> None:
    effect = registry.get("backlash")
    motion = carrying(np.where(np.arange(1000) < 1000 * loaded, -2.0, 2.0 * rest))
    assert effect.constants(motion) == ({"load_scale": pytest.approx(0.1)} if tells else {})
    assert ("share_under_load" in [one.name for one in effect.active(motion)]) == tells


def test_without_a_load_the_share_is_one() -> None:
    effect = registry.get("backlash")
    assert effect.constants(carrying(None)) == {}
    assert "share_under_load" not in [one.name for one in effect.active(carrying(None))]


@pytest.mark.parametrize(("share", "gap"), [(0.04, False), (0.06, True)])
def test_a_gap_holds_a_twentieth_of_the_friction_back_at_least(share: float, gap: bool) -> None:
    said = registry.get("backlash").implausible({"share_behind_gap": share, "share_at_once": 0.0}, {})
    assert said == (None if gap else "friction inside the gap would be 96 % of that outside it: no gap")


@pytest.mark.parametrize(("turns", "testable"), [(3, False), (4, True)])
@pytest.mark.parametrize("name", ["backlash", "hysteresis"])
def test_an_axis_that_hardly_ever_turned_round_shows_none(name: str, turns: int, testable: bool) -> None:
    velocity = np.where(np.arange(1000) * (turns + 1) // 1000 % 2 == 0, 1.0, -1.0)
    motion = Motion(TIME, np.zeros(1000, dtype=np.intp), np.cumsum(velocity) * 0.01, velocity, 0.0 * TIME)
    assert motion.reversals == turns
    assert (registry.get(name).untestable(motion) is None) == testable
