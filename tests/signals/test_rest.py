"""Which rows stand still, as far as a sensor can tell."""

from __future__ import annotations

import numpy as np
import pytest

from idtool.model.motion import Array, Motion
from idtool.signals.rest import standing

STEP = 0.01


def moving(velocity: Array, grain: float = 1e-3) -> tuple[Motion, Array]:
    """A motion and its reading in grains."""
    position = np.cumsum(velocity) * STEP
    n = len(velocity)
    time = np.arange(n) * STEP
    trial = np.zeros(n, dtype=np.intp)
    motion = Motion(time, trial, position, velocity, np.gradient(velocity, STEP))
    return motion, np.round(position / grain) * grain


def test_a_pause_between_two_moves() -> None:
    velocity = np.concatenate([np.full(200, 1.0), np.zeros(300), np.full(200, -1.0)])
    motion, reading = moving(velocity)
    found, unseen = standing(motion, reading, np.zeros(len(motion)))
    assert found[240:460].all()
    assert not found[:170].any()
    assert not found[530:].any()
    assert unseen == pytest.approx(1.5 * STEP)  # the smallest step that was read


@pytest.mark.parametrize("speed", [0.02, 0.2])
def test_slow_is_not_still(speed: float) -> None:
    """At 0.02 rad/s the reading changes every fifth row."""
    motion, reading = moving(np.full(1000, speed))
    assert not standing(motion, reading, np.zeros(len(motion)))[0].any()


def test_without_a_position_nothing_is_said_to_stand() -> None:
    motion, _ = moving(np.zeros(500))
    assert not standing(motion, None, np.zeros(500))[0].any()


@pytest.mark.parametrize(("swing", "more"), [(1.5, True), (0.5, False)])
def test_a_torque_that_swings_while_nothing_moves(swing: float, more: bool) -> None:
    """Up to where the axis leaves nothing is known of the bristle then; else the position tells."""
    velocity = np.concatenate([np.full(200, 1.0), np.zeros(300), np.full(200, 1.0)])
    motion, reading = moving(velocity)
    torque = np.interp(np.arange(700), [200, 499], [1.0 - swing, 1.0])
    torque[:200] = 1.0
    found, _ = standing(motion, reading, torque)
    assert found[230:470].all()
    assert found[480:497].all() == more
    assert not found[502:].any()
