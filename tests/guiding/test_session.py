"""A run from end to end: hand, figures, log, faults, and a rig with a hand of flesh."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.control import ForceFreeController, State
from idtool.errors import InputError, RigFault
from idtool.guiding import ConstantForceHand, ImpedanceHand, Push, teach
from idtool.guiding.figure import draw
from idtool.guiding.hand import smooth, travel_per_position
from idtool.guiding.record import Record, measure
from idtool.guiding.session import limits_of
from idtool.log import Log
from idtool.parameters import Parameter
from idtool.rig.base import Sample, TrialSetup
from idtool.rig.faults import LimitExceeded
from tests.control.double import Double, parameters

SETUP = TrialSetup(0.4, start_position=0.0)
SHORT = (Push(1, push_s=0.6, rest_s=0.4),)


def controller() -> ForceFreeController:
    return ForceFreeController(parameters(), 0.01, limits=limits_of(Double()))


def test_the_log_holds_the_run(tmp_path: Path) -> None:
    hand = ConstantForceHand(0.25, SHORT)
    result = teach(parameters(), controller(), Double(), SETUP, hand=hand, log=tmp_path / "run.csv")
    log = Log.read(tmp_path / "run.csv")
    assert not log.incomplete
    np.testing.assert_array_equal(log.frame["position_rad"], result.record.position)
    np.testing.assert_array_equal(log.frame["hand_nm"], result.record.hand)
    assert set(log.frame["payload_kg"]) == {0.4}
    with pytest.raises(InputError, match="already exists"):
        teach(parameters(), controller(), Double(), SETUP, hand=hand, log=tmp_path / "run.csv")


class Dying(Double):
    """Its encoder breaks after a second."""

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        sample = super().step(position_command, external_torque_nm)
        return replace(sample, position=math.nan) if sample.time_s > 1.0 else sample


def test_a_broken_encoder_stops_the_run_and_leaves_the_log(tmp_path: Path) -> None:
    hand = ConstantForceHand(0.25, SHORT)
    with pytest.raises(RigFault, match=r"after \d+ samples: position is nan"):
        teach(parameters(), controller(), Dying(), SETUP, hand=hand, log=tmp_path / "run.csv")
    assert len(Log.read(tmp_path / "run.csv").frame) in (99, 100)


class Fast(Double):
    """Its speed is read, for one sample, as so many times its limit."""

    share = 1.0

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        sample = super().step(position_command, external_torque_nm)
        fast = 1.0 < sample.time_s < 1.015
        return replace(sample, velocity=self.share * self.limits.speed) if fast else sample


@pytest.mark.parametrize(("share", "stopped"), [(1.45, False), (1.55, True)])
def test_a_hand_may_be_half_as_fast_again_as_the_limit(share: float, stopped: bool) -> None:
    rig = Fast()
    rig.share = share
    with pytest.raises(LimitExceeded, match="its velocity of") if stopped else nullcontext():
        teach(parameters(), controller(), rig, SETUP, hand=ConstantForceHand(0.25, SHORT))


class Interrupted(Double):
    """Somebody presses Ctrl-C."""

    stopped = False

    def step(self, position_command: float, external_torque_nm: float = 0.0) -> Sample:
        if self.time > 0.5:
            raise KeyboardInterrupt
        return super().step(position_command, external_torque_nm)

    def stop(self) -> None:
        self.stopped = True


def test_an_interrupt_stops_the_axis_and_keeps_the_rows(tmp_path: Path) -> None:
    rig = Interrupted()
    result = teach(parameters(), controller(), rig, SETUP, log=tmp_path / "run.csv")
    assert rig.stopped
    assert result.interrupted
    assert result.figures is None
    assert len(Log.read(tmp_path / "run.csv").frame) == len(result.record.time) >= 50


def test_a_real_rig_is_left_where_it_is_and_has_no_simulated_hand() -> None:
    rig = Double(simulated=False)
    here = TrialSetup(0.4)
    result = teach(parameters(), controller(), rig, here, duration_s=1.0)
    assert result.record.position[0] == pytest.approx(0.25, abs=0.002)
    assert np.ptp(result.record.position) < 0.01
    assert result.record.state[-1] == State.RESTING
    with pytest.raises(InputError, match="simulated hand"):
        teach(parameters(), controller(), rig, here, hand=ConstantForceHand(0.25))


def test_figures_of_a_made_up_run() -> None:
    """Known motion in, known figures out."""
    hand = ConstantForceHand(0.5, (Push(-1, push_s=1.0, rest_s=1.0),), start_s=0.5, rise_s=1e-9)
    time = 0.01 * np.arange(260)
    moving = np.clip(time - 0.5, 0.0, 1.05)  # goes on for 50 ms after letting go
    position = -0.4 * moving
    position[np.searchsorted(time, 1.545) : np.searchsorted(time, 1.575)] -= 0.02  # and springs back
    push = np.array([hand.torque(t, 0.0, 0.0) for t in time])
    zero = np.zeros_like(time)
    record = Record(
        time, position, zero, zero, zero, zero, push, push, zero, zero, tuple("guiding" for _ in time)
    )
    figures = measure(record, hand, resolution=0.001, travel_ratio=0.05)
    assert figures is not None
    (only,) = figures.pushes
    assert only.speed == pytest.approx(0.4, rel=0.02)
    assert only.speed_mm_s == pytest.approx(20.0, rel=0.02)
    assert only.force_n == pytest.approx(10.0, rel=0.02)
    assert only.stop_ms == pytest.approx(80.0, abs=10.1)  # the spring back ends it
    assert only.overshoot_counts == pytest.approx(20.0, abs=0.01)
    assert only.drift_counts_per_s == pytest.approx(0.0, abs=1e-6)
    assert only.ripple_counts == 0.0
    assert only.energy_to_hand == pytest.approx(-0.2, rel=0.02)


def test_a_run_cut_before_a_push_has_no_figures() -> None:
    hand = ConstantForceHand(0.25, SHORT)
    assert teach(parameters(), controller(), Double(), SETUP, hand=hand, duration_s=0.3).figures is None


def test_the_hand_s_target_is_smooth_and_goes_where_it_should() -> None:
    hand = ImpedanceHand(0.4, 1.0, 0.1, (Push(1, push_s=2.0, hold_s=1.0),))
    push = hand.sequence[0]
    times = np.arange(0.0, 3.0, 1e-3)
    path = np.array([hand.target(push, t) for t in times])
    np.testing.assert_allclose(np.gradient(path[:, 0], times)[1:-1], path[1:-1, 1], atol=1e-3)
    assert path[:, 1].max() == pytest.approx(0.4)
    assert path[-1, 1] == pytest.approx(0.0, abs=1e-12)
    assert path[-1, 0] == pytest.approx(0.8)
    assert [smooth(s) for s in (-1.0, 0.0, 0.5, 1.0, 2.0)] == [0.0, 0.0, 0.5, 1.0, 1.0]


def test_the_hand_lets_go_at_once_and_grasps_anew() -> None:
    hand = ImpedanceHand(0.4, 1.0, 0.0, (Push(1, push_s=1.0, rest_s=1.0), Push(-1, push_s=1.0, rest_s=1.0)))
    assert hand.torque(0.0, 5.0, 0.0) == 0.0
    assert hand.torque(0.6, 5.0, 0.0) == pytest.approx(0.0, abs=1e-12)  # the spring starts where the grip is
    assert hand.torque(1.59, 5.0, 0.0) > 0.2
    assert hand.torque(1.6, 5.0, 0.0) == 0.0
    assert hand.torque(2.6, 7.0, 0.0) == pytest.approx(0.0, abs=1e-12)
    assert hand.torque(3.5, 7.0, 0.0) < -0.2


@pytest.mark.parametrize("sequence", [(), (Push(0),), (Push(1, push_s=0.0),), (Push(1, hold_s=-1.0),)])
def test_an_impossible_sequence_is_refused(sequence: tuple[Push, ...]) -> None:
    with pytest.raises(InputError, match="hand needs pushes"):
        ConstantForceHand(0.1, sequence)


def test_an_arm_does_not_say_how_far_a_radian_goes() -> None:
    arm = replace(parameters(), gravity_model="arm", gravity={"sin": Parameter(0.5), "cos": Parameter(0.1)})
    assert travel_per_position(arm) is None
    result = teach(arm, ForceFreeController(arm, 0.01), Double(), SETUP, duration_s=0.1)
    draw(result.record)  # in N m and rad


def test_the_picture(tmp_path: Path) -> None:
    hand = ConstantForceHand(0.25, SHORT)
    result = teach(parameters(), controller(), Double(), SETUP, hand=hand)
    figure = draw(result.record, travel_ratio=0.05)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert labels == ["Torque, N m", "Stroke, mm", "Hand, N", "Hand, N"]
    figure.savefig(tmp_path / "run.png", dpi=60)
    assert (tmp_path / "run.png").stat().st_size > 5000
