"""The Feetech rig on the virtual servo: what it sets, how it moves, and what it puts back."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from idtool.errors import InputError, RigFault
from idtool.rig import open_rig
from idtool.rig.base import Trajectory, TrialSetup
from idtool.rig.bus.rig import period_needed
from idtool.rig.bus.transactions import TRIES
from idtool.rig.faults import DeviceGone, LimitExceeded, NotAnswering, NotFollowing, WrongServo
from idtool.rig.feetech.bus import BYTES_PER_PERIOD
from idtool.rig.feetech.models import Register
from idtool.rig.feetech.servo import AHEAD_S

from ..dynamixel.support import BAUD, Bench, sine

KIND = {"kind": "feetech"}


def test_what_the_servo_says_is_taken() -> None:
    with Bench(**KIND) as on, on.rig() as rig:
        assert rig.limits.position == pytest.approx((-2.5, 2.5), abs=2e-3)
        assert rig.limits.speed == pytest.approx(5.215, abs=0.01)
        assert (rig.limits.current, rig.limits.duty, rig.limits.temperature) == (np.inf, 1.0, 70.0)
        assert (rig.measures, rig.measures_bus_current) == ("voltage", False)
        assert (rig.axis.torque_constant, rig.axis.torque_per_volt) == (None, None)
        assert rig.period_s == 0.005
        assert rig.description == "Feetech STS3215"
        assert rig.speed_step == pytest.approx(2 * np.pi / 4096)


def test_options_narrow_the_limits_in_the_servo_too() -> None:
    with Bench(**KIND) as on:
        before = on.table()
        with on.rig(low=-1.0, high=1.5, speed=0.8, duty=0.4, per_volt=0.3, period=0.01) as rig:
            assert rig.limits.position == (-1.0, 1.5)
            assert (rig.limits.speed, rig.limits.duty, rig.period_s) == (0.8, 0.4, 0.01)
            assert rig.axis.torque_per_volt == 0.3
            assert on.servo.table["torque_limit"] == 400
        assert on.table() == before
        for wrong, sentence in (
            ({"current": 0.5}, "current: the Feetech STS3215 measures no current of its motor; give duty="),
            ({"constant": 2.0}, "constant: the Feetech STS3215 measures no current .* give per_volt="),
            ({"low": 2.6}, "give low and high"),
        ):
            with pytest.raises(InputError, match=sentence):
                on.rig(**wrong)
        assert on.table() == before


def test_a_servo_with_a_current_takes_no_duty() -> None:
    with Bench() as on:
        for wrong in ({"duty": 0.5}, {"per_volt": 0.3}):
            with pytest.raises(InputError, match="XH540-V150 measures the current of its motor; give c"):
                on.rig(**wrong)


@pytest.mark.parametrize("fine", [True, False])
def test_a_trajectory_of_speeds_is_followed(fine: bool) -> None:
    with Bench(**KIND) as on:
        on.servo.table["phase"] = 12 if fine else 8
        with on.rig(speed=2.0) as rig:
            rig.prepare(TrialSetup(start_position=0.3, rest_s=0.1))
            command = sine(rig, 2.0, 0.8)
            blocks = list(rig.play(Trajectory(rig.period_s, "velocity", command)))
            names = ("time_s", "position", "velocity", "command", "temperature", "voltage", "duty")
            time, position, velocity, sent, warm, volt, duty = (
                np.concatenate([getattr(block, name) for block in blocks]) for name in names
            )
            assert len(command) * 0.7 < len(time) <= len(command)
            assert time[-1] - time[0] == pytest.approx(2.0, abs=0.03)
            assert position[0] == pytest.approx(0.3, abs=0.03)
            assert np.ptp(position) == pytest.approx(1.6 / np.pi, abs=0.05)
            assert np.corrcoef(velocity, sent)[0, 1] > 0.9
            assert np.allclose(np.round(sent / rig.speed_step), sent / rig.speed_step)
            assert set(np.round(volt, 9)) == {24.0}
            assert np.all(warm == 25.0)
            assert np.corrcoef(np.sign(velocity), duty)[0, 1] > 0.7  # friction


def test_a_servo_that_hears_nothing_stops_at_its_goal() -> None:
    """There is no watchdog: every goal is one at which the axis may stand."""
    with Bench(**KIND) as on, on.rig(speed=2.0) as rig:
        rig.prepare(TrialSetup(start_position=-0.5, rest_s=0.0))
        blocks = rig.play(Trajectory(rig.period_s, "velocity", np.full(400, 0.8)))
        for _ in range(6):
            block = next(blocks)
        was = block.position[-1]
        assert block.velocity[-1] == pytest.approx(0.8, abs=0.1)
        stood, speed = on.later(AHEAD_S + 0.4)
        assert abs(speed) < 1e-3
        assert 0.0 < stood - was < 0.8 * (AHEAD_S + 0.1)


def test_an_axis_that_stands_is_taken_over_and_held_gently() -> None:
    """Its goal may be a little off where it stands: as fast as it can it would jump there."""
    with Bench(**KIND) as on, on.rig(speed=2.0) as rig:
        rig.prepare(TrialSetup(rest_s=0.0))
        rig.stop()
        assert on.servo.table["goal_speed"] * rig.speed_step == pytest.approx(0.15, rel=0.01)


def test_positions_are_stepped_to_and_kept_within_the_limits() -> None:
    with Bench(**KIND) as on, on.rig(low=-0.2, high=0.2, speed=2.0) as rig:
        rig.prepare(TrialSetup(start_position=0.0, rest_s=0.0))
        for goal in (0.1, 0.5):
            for _ in range(200):
                sample = rig.step(goal)
            assert sample.position == pytest.approx(min(goal, 0.2), abs=4e-3)
        assert sample.effort == pytest.approx(sample.duty * sample.voltage)
        with pytest.raises(RigFault, match="simulated hand"):
            rig.step(0.0, 0.1)


@pytest.mark.parametrize("way", ["end", "exception", "interrupt", "generator left"])
def test_every_way_out_leaves_the_servo_as_it_was_found(way: str) -> None:
    with Bench(**KIND) as on:
        before = on.table() | {name: on.servo.table[name] for name in ("acceleration", "goal_speed")}
        try:
            with on.rig(speed=2.0, duty=0.9) as rig:
                rig.prepare(TrialSetup(start_position=0.2, rest_s=0.0))
                blocks = rig.play(Trajectory(rig.period_s, "velocity", np.full(400, 0.4)))
                next(blocks)
                if way == "exception":
                    raise ZeroDivisionError
                if way == "interrupt":
                    os.kill(os.getpid(), signal.SIGINT)
                    for _ in blocks:
                        pass
                if way == "generator left":
                    blocks.close()
                    assert on.stands(0.3)
        except (ZeroDivisionError, KeyboardInterrupt):
            pass
        after = on.table() | {name: on.servo.table[name] for name in ("acceleration", "goal_speed")}
        assert after == before
        assert before["torque_enable"] == 0
        assert on.stands(0.3)


@pytest.mark.parametrize("at", range(0, 40, 5))
def test_ctrl_c_at_any_transaction_leaves_the_servo_as_it_was_found(at: int) -> None:
    with Bench(**KIND) as on:
        before = on.table()
        rig = on.rig(speed=2.0)
        ask, count = rig._bus._ask, 0

        def interrupted(*arguments: object, **options: object) -> bytes:
            nonlocal count
            count += 1
            answer: bytes = ask(*arguments, **options)
            if count == at + 1:
                os.kill(os.getpid(), signal.SIGINT)
            return answer

        rig._bus._ask = interrupted

        def session() -> None:
            with rig:
                rig.prepare(TrialSetup(start_position=0.05, rest_s=0.0))
                list(rig.play(Trajectory(rig.period_s, "velocity", np.full(40, 0.4))))

        with pytest.raises(KeyboardInterrupt):
            session()
        assert on.table() == before
        assert on.stands(0.3)


def test_servos_that_do_not_fit() -> None:
    with Bench(**KIND) as on:
        on.servo.table["byte_order"] = 1
        with pytest.raises(WrongServo, match="no servo of the STS or SMS series"):
            on.rig()
        on.servo.table["byte_order"] = 0
        on.servo.table["min_position_limit"] = on.servo.table["max_position_limit"] = 0
        with pytest.raises(WrongServo, match="set to turn without limits"):
            on.rig()
    with Bench(**KIND, model=1234) as on, on.rig() as rig:
        assert rig.description == "Feetech STS/SMS model 1234"


def test_a_servo_in_its_speed_mode_is_put_back_into_it() -> None:
    with Bench(**KIND) as on:
        on.servo.table["operating_mode"] = 1
        on.servo.table["status_level"] = 0
        with on.rig(speed=2.0) as rig:
            rig.prepare(TrialSetup(start_position=0.05, rest_s=0.0))
            assert on.servo.table["operating_mode"] == 0
        assert on.servo.table["operating_mode"] == 1


def test_nobody_there() -> None:
    with Bench(**KIND) as on:
        with pytest.raises(NotAnswering, match=r"id 3 .* does not answer at 1000000 baud; check power"):
            on.rig(id=3)
        with pytest.raises(NotAnswering, match="does not answer at 500000 baud"):
            on.rig(baud=500_000)
        with pytest.raises(InputError, match="no baud rate 12345; take 115200, 500000 or 1000000"):
            on.rig(baud=12345)
        with on.rig(), pytest.raises(DeviceGone, match="in use by another program"):
            on.rig()
    with pytest.raises(DeviceGone, match="there is no such device"):
        open_rig("feetech:/dev/none,id=1,baud=1000000")


def test_a_start_that_cannot_be() -> None:
    with Bench("stuck@0", **KIND) as on, on.rig(low=-1.0, high=1.0, speed=2.0) as rig:
        with pytest.raises(LimitExceeded, match=r"cannot start at 1.5 rad"):
            rig.prepare(TrialSetup(start_position=1.5))
        with pytest.raises(NotFollowing, match="not reach the start"):
            rig.prepare(TrialSetup(start_position=0.3))


def test_the_period_and_the_retries_fit_the_bus() -> None:
    assert period_needed(BYTES_PER_PERIOD, BAUD, 0.0, 0.0) < 0.005
    assert TRIES * 0.055 < 0.25  # the SDK waits 50 ms for a lost answer


def test_sign_and_magnitude() -> None:
    load = Register(60, 2, 10)
    assert [load.decode(load.encode(value)) for value in (-1000, -1, 0, 1, 1000)] == [-1000, -1, 0, 1, 1000]
    assert load.encode(-1) == bytes([1, 4])
    assert Register(58, 2, 15).decode(b"\x05\x80") == -5
