"""Everything that goes wrong with a servo and its bus, through the real protocol: the axis ends safe."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

import pytest

from idtool.errors import InputError, RigFault
from idtool.experiment.black_box import fault_path
from idtool.experiment.runner import Progress, run
from idtool.log import Log
from idtool.rig.dynamixel.servo import WATCHDOG_S
from idtool.rig.faults import (
    DeviceGone,
    NotAnswering,
    NotFollowing,
    ServoRestarted,
    ServoShutdown,
    WatchdogTripped,
)
from idtool.virtual_servo.faults import parse_fault
from testbench.kill import killed

from .support import Bench, log_path, recipe

#: A moving axis stands this long after the servo heard the last word: its watchdog, and the plant's brake.
STOPS_WITHIN_S = WATCHDOG_S + 0.15


def _long(*values: object) -> object:
    """A case like one that stays."""
    return pytest.param(*values, marks=pytest.mark.long)


def play(on: Bench, folder: Path, **options: object) -> None:
    with on.rig() as rig:
        run(recipe(), rig, log_path(folder), confirm=on.setup, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "word", ["lost=0.01", "corrupt=0.01", "burst@3=0.04", *map(_long, ("late=0.01", "twice=0.01"))]
)
def test_what_a_bus_does_to_packets_does_not_stop_a_run(tmp_path: Path, word: str) -> None:
    with Bench(word, seed=3) as on:
        before = on.table()
        play(on, tmp_path)
        assert sum(on.mishaps.counts.values()) >= 1
        log = Log.read(log_path(tmp_path))
        assert len(log.trials) == 2
        frame = log.frame
        # no reading is damaged, and none belongs to another instant
        assert frame["position_rad"].between(-0.4, 0.4).all()
        assert frame["velocity_rad_s"].abs().max() < 0.7
        way, passed = frame["position_rad"].diff().abs(), frame["time_s"].diff()
        assert (way - 0.6 * passed)[frame["trial"].diff() == 0].max() < 0.012
        assert set(frame["supply_voltage_v"]) == {24.0}
        assert on.table() == before
        assert on.stands(0.3)


@pytest.mark.parametrize(
    ("word", "kind", "sentence"),
    [
        ("burst@3=0.6", NotAnswering, "does not answer at 1000000 baud; check power, cable"),
        _long("silent@3", NotAnswering, "does not answer at 1000000 baud; check power, cable"),
        ("unplugged@3", DeviceGone, "has disappeared"),
        ("power@3", ServoRestarted, "lost its power for a moment"),
        ("overload@3", ServoShutdown, "reports overload"),
        _long("error@3=4", ServoShutdown, "reports overheating"),
        _long("error@3=1", ServoShutdown, "reports supply voltage out of range"),
        _long("error@3=8", ServoShutdown, "reports motor encoder fault"),
        ("stuck@3", NotFollowing, "its position does not follow the commands"),
        ("watchdog@3", WatchdogTripped, "the servo's watchdog stopped the axis"),
    ],
)  # fmt: skip
def test_what_ends_a_run_ends_it_safely(
    tmp_path: Path, word: str, kind: type[RigFault], sentence: str
) -> None:
    with Bench(word) as on:
        before = on.table()
        with pytest.raises(kind) as caught:
            play(on, tmp_path)
        assert sentence in str(caught.value)
        assert on.stands(STOPS_WITHIN_S)
        if kind not in (NotAnswering, DeviceGone):
            after = on.table() | {"hardware_error_status": 0}
            assert after == before
        log = Log.read(log_path(tmp_path))
        assert not log.incomplete
        assert f"the {len(log.frame)} rows up to there are in {log_path(tmp_path)}" in str(caught.value)
        last = Log.read(fault_path(log_path(tmp_path)))
        assert (last.experiment, last.header["fault"]) == ("fault", kind.__name__)
        length = last.frame["time_s"].iloc[-1] - last.frame["time_s"].iloc[0]
        assert 0.3 < length < 1.0 + 1e-9  # as far as a difference of times is exact
        assert caught.value.history.position[-1] == pytest.approx(last.frame["position_rad"].iloc[-1])


def test_the_watchdog_of_the_servo_stops_what_nobody_can_reach(tmp_path: Path) -> None:
    """The time from the last word to standstill, on the axis itself."""
    with Bench("silent@3") as on:
        with pytest.raises(NotAnswering):
            play(on, tmp_path)
        on.later(1.0)
        stood_after = on.clock.now() - on.servo.axis.still_s - (on.mishaps.struck_at or 0.0)
        assert WATCHDOG_S < stood_after < STOPS_WITHIN_S
        assert on.servo.table["bus_watchdog"] == -1


@pytest.mark.parametrize("seed", [1, _long(2)])
def test_a_killed_process_leaves_a_whole_log_and_a_standing_axis(seed: int) -> None:
    """A sample of `make study-reliability`; slowly, for the computer may be busy."""
    found = killed(seed, scale=0.5)
    assert found.tripped
    assert found.stood_after_s < STOPS_WITHIN_S
    assert found.whole
    assert found.rows > 20


@pytest.mark.parametrize(("seconds", "trips"), [(0.06, False), (0.5, True)])
def test_a_slow_computer(tmp_path: Path, seconds: float, trips: bool) -> None:
    """A stall below the watchdog is counted, one above it ends the run."""
    stalled = 0

    def stall(now: Progress) -> None:
        nonlocal stalled
        if now.share > 0.2 and not stalled:
            stalled += 1
            until = time.process_time() + seconds
            while time.process_time() < until:  # the clock of the bench counts computing
                pass

    with Bench() as on:
        if trips:
            with pytest.raises(WatchdogTripped, match="the computer was busy or the cable is loose"):
                play(on, tmp_path, progress=stall)
        else:
            with on.rig() as rig:
                done = run(recipe(), rig, log_path(tmp_path), confirm=on.setup, progress=stall)
            assert done.loop.overruns >= 1
            assert done.loop.longest_s >= seconds
            assert done.loop.longest_s < WATCHDOG_S
        assert stalled == 1
        assert on.stands(0.3)


def test_a_servo_in_error_is_refused_before_it_moves(tmp_path: Path) -> None:
    with Bench() as on:
        on.servo.fail(0x20)
        with pytest.raises(ServoShutdown, match=r"reports overload .* switch its power off and on"):
            on.rig()


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("lots=0.1", 'unknown fault "lots=0.1"; did you mean "lost=RATE"'),
        ("smoke@1", "unknown fault .* known are burst@SECONDS"),
        ("lost=2", "is no share"),
        ("lost", "write lost=RATE"),
        ("burst@1", "burst@SECONDS=VALUE"),
        ("silent@x", "no number"),
        ("silent@nan", "no number"),
        ("error@1=-4", "no number"),
    ],
)
def test_faults_are_read_strictly(word: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        parse_fault(word)


def test_a_bus_that_loses_much_is_waited_for_while_nothing_moves() -> None:
    with Bench("lost=0.3", seed=1) as on:
        rig = on.rig()  # some 30 transactions, of which 7 in 100 fail four times
        assert rig.retries > 10
        with suppress(RigFault):
            rig.close()
