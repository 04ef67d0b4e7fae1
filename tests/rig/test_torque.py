"""A drive that takes torques goes where it is told: under a load, against a block, at its limit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from idtool.errors import InputError
from idtool.parameters.axis import Axis
from idtool.rig.base import Limits, Sample, Trajectory, TrialSetup
from idtool.rig.faults import LimitExceeded, NotFollowing
from idtool.rig.torque import TorqueRig


class Arm(TorqueRig):
    """J dw/dt = torque - 0.4 sin(q), and a stop at `block`."""

    axis = Axis("rotary", 0.5)
    limits = Limits(position=(-2.0, 2.0), speed=3.0, current=2.0)
    period_s = 0.002
    description = "an arm"
    inertia = 0.004
    bandwidth = 60.0

    def __init__(self, block: float = math.inf) -> None:
        super().__init__()
        self._block = block
        self._time = self._position = self._velocity = 0.0
        self.applied: list[float] = []
        self.let = 0

    def apply(self, torque: float) -> Sample:
        self.applied.append(torque)
        self._velocity += self.period_s * (torque - 0.4 * math.sin(self._position)) / self.inertia
        self._position += self.period_s * self._velocity
        if self._position > self._block:
            self._position, self._velocity = self._block, 0.0
        self._time += self.period_s
        return Sample(self._time, self._position, self._velocity, torque / 0.5)

    def let_go(self) -> None:
        self.let += 1


def test_it_holds_a_load_where_it_is_told_to() -> None:
    rig = Arm()
    rig.prepare(TrialSetup(start_position=1.0, rest_s=0.5))
    assert rig.where() == pytest.approx(1.0, abs=1e-6)
    assert rig.applied[-1] == pytest.approx(0.4 * math.sin(1.0), abs=1e-5)
    # the next trial starts from there: nothing jumps
    rig.prepare(TrialSetup(rest_s=0.1))
    assert np.ptp(rig.applied[-40:]) < 1e-4


def test_it_follows_a_speed_under_a_load() -> None:
    rig = Arm()
    rig.prepare(TrialSetup(start_position=0.5))
    speed = 0.5 * np.sin(2.0 * np.pi * np.arange(1000) * rig.period_s)
    blocks = list(rig.play(Trajectory(rig.period_s, "velocity", speed)))
    position, velocity = (np.concatenate([getattr(b, n) for b in blocks]) for n in ("position", "velocity"))
    assert len(blocks) == 8
    np.testing.assert_allclose(position, 0.5 + np.cumsum(speed) * rig.period_s, atol=2e-3)
    np.testing.assert_allclose(velocity, speed, atol=0.02)


def test_it_goes_to_a_start_slowly_and_waits_for_it() -> None:
    class Soft(Arm):
        bandwidth = 15.0

    rig = Soft()
    rig._position = 1.2  # held by nobody: a loop this slow finds the load while it sags
    rig.prepare(TrialSetup(rest_s=0.0))
    assert rig.where() == pytest.approx(1.2, abs=0.04)
    rig = Arm()
    rig.prepare(TrialSetup(start_position=1.5, rest_s=0.0))
    assert 3.4 < len(rig.applied) * rig.period_s < 3.5  # up to a quarter of 3 rad/s, and settled
    assert max(map(abs, rig.applied)) < 0.41  # the load, and no jerk


def test_a_stop_brakes() -> None:
    rig = Arm()
    rig.prepare(TrialSetup(start_position=0.0))
    blocks = rig.play(Trajectory(rig.period_s, "velocity", np.full(1000, 2.0)))
    assert next(blocks).velocity[-1] == pytest.approx(2.0, abs=0.1)
    rig.stop()
    assert abs(rig._velocity) < 1e-3


def test_what_is_blocked_is_told_and_pushed_no_harder_than_the_limit() -> None:
    rig = Arm(block=0.3)
    with pytest.raises(NotFollowing, match=r"stands at 0\.3 instead of 1; see what blocks it"):
        rig.prepare(TrialSetup(start_position=1.0))
    assert max(rig.applied) == pytest.approx(2.0 * 0.5)
    # what the drive could not give was not saved up: once free it settles at once
    rig._block = math.inf
    rig.prepare(TrialSetup(start_position=1.0, rest_s=0.3))
    assert rig.where() == pytest.approx(1.0, abs=1e-3)


def test_a_start_outside_the_limits_and_a_loop_too_fast_are_refused() -> None:
    with pytest.raises(LimitExceeded, match="cannot start at 3, outside its limits -2 to 2"):
        Arm().prepare(TrialSetup(start_position=3.0))

    class Fast(Arm):
        bandwidth = 300.0

    with pytest.raises(InputError, match=r"too fast for a period of 0\.002 s; lower bandwidth to 200"):
        Fast()


def test_it_lets_go_however_it_ends() -> None:
    rig = Arm()
    rig.prepare(TrialSetup(start_position=0.2))
    rig.close()
    rig.close()
    assert rig.let == 1
