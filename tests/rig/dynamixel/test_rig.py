"""The DYNAMIXEL rig on the virtual servo: what it sets, how it moves, and what it puts back."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest

from idtool.errors import InputError, RigFault
from idtool.rig import open_rig
from idtool.rig.base import Trajectory, TrialSetup
from idtool.rig.bus.rig import period_needed
from idtool.rig.bus.settings import Settings
from idtool.rig.bus.transactions import TRIES
from idtool.rig.dynamixel.bus import BYTES_PER_PERIOD
from idtool.rig.dynamixel.models import MODELS, WATCHDOG_UNIT, Model
from idtool.rig.dynamixel.servo import DYNAMIXEL, WATCHDOG_S
from idtool.rig.faults import DeviceGone, LimitExceeded, NotAnswering, NotFollowing, WrongServo
from idtool.rig.plant import POSITION

from .support import BAUD, Bench, sine


def test_what_the_servo_says_is_taken() -> None:
    with Bench() as on, on.rig() as rig:
        assert rig.limits.position == pytest.approx((-2.5, 2.5), abs=2e-3)
        assert rig.limits.speed == pytest.approx(2.0, abs=0.025)
        assert rig.limits.current == pytest.approx(1.5, abs=0.003)
        assert rig.limits.temperature == 80.0
        assert rig.axis.torque_constant == pytest.approx(6.4 / 2.4)
        assert rig.period_s == 0.005
        assert rig.description == "DYNAMIXEL XH540-V150"
        assert (rig.simulated, rig.by_hand) == (False, True)


def test_options_narrow_the_limits_in_the_servo_too() -> None:
    with Bench() as on:
        before = on.table()
        with on.rig(low=-1.0, high=1.5, speed=0.8, current=0.7, constant=2.7, period=0.01) as rig:
            assert rig.limits.position == (-1.0, 1.5)
            assert (rig.limits.speed, rig.limits.current, rig.period_s) == (0.8, 0.7, 0.01)
            assert rig.axis.torque_constant == 2.7
            assert on.servo.table["velocity_limit"] == 34  # 0.8 rad/s, rounded up
            assert on.servo.table["current_limit"] == 261
        assert on.table() == before
        with pytest.raises(InputError, match="speed: the servo itself is limited to 2"):
            on.rig(speed=3.0)
        with pytest.raises(InputError, match="give low and high"):
            on.rig(low=2.6)
        assert on.table() == before


def test_a_trajectory_of_speeds_is_followed() -> None:
    with Bench() as on, on.rig() as rig:
        rig.prepare(TrialSetup(start_position=0.3, rest_s=0.1))
        command = sine(rig, 2.0)
        blocks = list(rig.play(Trajectory(rig.period_s, "velocity", command)))
        time, position, velocity, sent, warm, volt = (
            np.concatenate([getattr(block, name) for block in blocks])
            for name in ("time_s", "position", "velocity", "command", "temperature", "voltage")
        )
        # a busy computer leaves samples out, and keeps the time
        assert len(command) * 0.7 < len(time) <= len(command)
        assert time[-1] - time[0] == pytest.approx(2.0, abs=0.03)
        assert np.all(np.diff(time) > 0.0)
        assert position[0] == pytest.approx(0.3, abs=0.02)
        assert np.ptp(position) == pytest.approx(1.0 / np.pi, abs=0.02)
        # the drive's profile lags by some hundredths of a second
        assert np.corrcoef(velocity, sent)[0, 1] > 0.95
        assert set(np.round(sent / (0.229 * 2 * np.pi / 60), 6) % 1.0) == {0.0}
        assert set(volt) == {24.0}
        assert np.all(warm == 25.0)


def test_positions_are_stepped_to_and_kept_within_the_limits() -> None:
    with Bench() as on, on.rig(low=-0.2, high=0.2) as rig:
        rig.prepare(TrialSetup(start_position=0.0, rest_s=0.0))
        for goal in (0.1, 0.5):
            for _ in range(200):
                sample = rig.step(goal)
            assert sample.position == pytest.approx(min(goal, 0.2), abs=4e-3)
        assert on.servo.table["operating_mode"] == 5
        assert on.servo.table["profile_velocity"] > 0
        with pytest.raises(RigFault, match="simulated hand"):
            rig.step(0.0, 0.1)
        with pytest.raises(RigFault, match="not a finite number"):
            rig.step(float("nan"))


def test_positions_are_played() -> None:
    with Bench() as on, on.rig() as rig:
        rig.prepare(TrialSetup(start_position=0.0, rest_s=0.0))
        command = np.linspace(0.0, 0.3, 100)
        blocks = list(rig.play(Trajectory(2 * rig.period_s, "position", command)))
        assert blocks[-1].position[-1] == pytest.approx(0.3, abs=0.03)
        assert blocks[-1].time_s[-1] - blocks[0].time_s[0] == pytest.approx(1.0, abs=0.03)


def test_the_watchdog_is_armed_only_while_the_axis_may_move() -> None:
    with Bench() as on, on.rig() as rig:
        rig.prepare(TrialSetup(start_position=0.2, rest_s=0.0))
        assert on.servo.table["bus_watchdog"] == 0
        for _ in rig.play(Trajectory(rig.period_s, "velocity", sine(rig, 0.3))):
            assert on.servo.table["bus_watchdog"] == WATCHDOG_S / WATCHDOG_UNIT
        assert on.servo.table["bus_watchdog"] == 0
        rig.step(0.2)
        assert on.servo.table["bus_watchdog"] > 0
        rig.stop()
        assert on.servo.table["bus_watchdog"] == 0


def test_all_tries_together_are_shorter_than_the_watchdog() -> None:
    sdk_waits = 2 * 16e-3 + 2e-3 + 40 * 10 / 57600
    assert TRIES * sdk_waits < WATCHDOG_S


@pytest.mark.parametrize("way", ["end", "exception", "interrupt", "generator left"])
def test_every_way_out_leaves_the_servo_as_it_was_found(way: str) -> None:
    with Bench() as on:
        before = on.table()
        try:
            with on.rig() as rig:
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
        assert on.table() == before
        assert before["torque_enable"] == 0
        assert on.stands(0.3)


@pytest.mark.parametrize("at", range(0, 60, 4))
def test_ctrl_c_at_any_transaction_leaves_the_servo_as_it_was_found(at: int) -> None:
    with Bench() as on:
        before = on.table()
        rig = on.rig()
        ask, count = rig._bus._ask, 0

        def interrupted(*arguments: object, **options: object) -> bytes:
            nonlocal count
            count += 1
            answer = ask(*arguments, **options)  # type: ignore[arg-type]
            if count == at + 1:
                os.kill(os.getpid(), signal.SIGINT)
            return answer

        rig._bus._ask = interrupted  # type: ignore[method-assign]

        def session() -> None:
            with rig:
                rig.prepare(TrialSetup(start_position=0.05, rest_s=0.0))
                list(rig.play(Trajectory(rig.period_s, "velocity", np.full(40, 0.4))))

        with pytest.raises(KeyboardInterrupt):
            session()
        assert on.table() == before
        assert on.stands(0.3)


@pytest.mark.parametrize("number", MODELS)
def test_every_model_of_the_table_is_driven(number: int) -> None:
    with Bench(model=number) as on, on.rig() as rig:
        assert rig.description.endswith(MODELS[number].name)
        model = MODELS[number]
        assert rig.measures == ("current" if model.senses == "motor" else "voltage")
        assert rig.axis.torque_constant == (model.torque_constant if model.senses == "motor" else None)
        assert rig.axis.torque_per_volt == (None if model.senses == "motor" else model.torque_per_volt)


def test_the_torque_constant_of_the_paper() -> None:
    assert Model("XH540-V150", 6.4, 2.4, 24.0).torque_constant == pytest.approx(2.67, abs=0.01)


def test_another_model_is_refused_untouched() -> None:
    with Bench(model=350) as on:
        before = on.table()
        with pytest.raises(WrongServo, match="model number 350, which is none of MX-28"):
            on.rig()
        assert on.table() == before


def test_settings_of_the_servo_that_do_not_fit() -> None:
    with Bench() as on:
        on.servo.table["drive_mode"] = 0x04 | 0x08  # profiles as times, torque on by a goal
        before = on.table()
        with on.rig():
            assert on.servo.table["drive_mode"] == 0
        assert on.table() == before
        on.servo.table["drive_mode"] = 0x02
        with pytest.raises(WrongServo, match="follow another one"):
            on.rig()


def test_a_servo_that_was_set_to_silence_is_woken() -> None:
    with Bench() as on:
        on.servo.table["status_return_level"] = 0
        with on.rig() as rig:
            rig.prepare(TrialSetup(start_position=0.05, rest_s=0.0))


def test_nobody_there(tmp_path: Path) -> None:
    with Bench() as on:
        with pytest.raises(NotAnswering, match=r"id 3 .* does not answer at 1000000 baud; check power"):
            on.rig(id=3)
        with pytest.raises(NotAnswering, match="does not answer at 57600 baud"):
            on.rig(baud=57600)
        with pytest.raises(DeviceGone, match="there is no such device"):
            open_rig(f"dynamixel:{tmp_path}/none")
        with pytest.raises(DeviceGone, match="no serial port"):
            open_rig(f"dynamixel:{tmp_path}")
        with pytest.raises(InputError, match="the SDK has no baud rate 12345"):
            on.rig(baud=12345)


def test_a_port_in_use_is_refused() -> None:
    with Bench() as on, on.rig(), pytest.raises(DeviceGone, match="in use by another program"):
        on.rig()


def test_no_permission() -> None:
    with Bench() as on:
        os.chmod(on.terminal.path, 0)
        if os.geteuid() != 0:
            with pytest.raises(DeviceGone, match="no permission; add yourself to the group"):
                on.rig()
            return
        child = os.fork()  # root may do anything, so somebody else tries
        if child == 0:
            code = 1
            try:
                os.setuid(65534)
                on.rig()
            except DeviceGone as fault:
                code = 0 if "no permission; add yourself to the group" in str(fault) else 2
            finally:
                os._exit(code)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_a_start_outside_the_limits_is_refused() -> None:
    with Bench() as on, on.rig(low=-1.0, high=1.0) as rig:
        with pytest.raises(LimitExceeded, match=r"cannot start at 1.5 rad"):
            rig.prepare(TrialSetup(start_position=1.5))
        on.servo.axis._state[POSITION] = 1.2
        with pytest.raises(LimitExceeded, match=r"stands at 1.2 rad, outside its limits -1 to 1 rad"):
            rig.prepare(TrialSetup())
        with pytest.raises(RigFault, match="not prepared"):
            rig.step(0.0)


def test_a_blocked_axis_does_not_reach_its_start() -> None:
    with (
        Bench("stuck@0") as on,
        on.rig() as rig,
        pytest.raises(NotFollowing, match="not reach the start"),
    ):
        rig.prepare(TrialSetup(start_position=0.3))


def test_a_closed_rig_says_so() -> None:
    with Bench() as on:
        rig = on.rig()
        rig.close()
        rig.close()
        rig.stop()
        with pytest.raises(RigFault, match="closed"):
            rig.prepare(TrialSetup())


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("id=300", 'id: "300" is not a whole number from 0 to 252'),
        ("id=1.5", 'id: "1.5" is not a whole number'),
        ("baud=fast", 'baud: "fast" is not a whole number from 9600'),
        ("low=1,high=0", "low is not below high"),
        ("speed=nan", 'speed: "nan" is not a number'),
        ("sped=1", 'did you mean "speed"'),
        ("speed", "not one key=value"),
    ],
)
def test_options_are_read_strictly(words: str, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        open_rig(f"dynamixel:/dev/none,{words}")


def test_the_period_is_what_bus_and_adapter_can_do() -> None:
    assert period_needed(BYTES_PER_PERIOD, BAUD, 0.0, 0.0) < 0.005
    assert 0.01 < period_needed(BYTES_PER_PERIOD, 57600, 0.0, 0.0) < 0.02
    assert 0.032 < period_needed(BYTES_PER_PERIOD, BAUD, 0.0, 0.016) < 0.05
    assert Settings().baud is None
    assert DYNAMIXEL.baud == 57600
