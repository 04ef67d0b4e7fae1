"""Everything that goes wrong with a Feetech servo and its bus: the axis ends safe."""

from __future__ import annotations

from pathlib import Path

import pytest

from idtool.errors import RigFault
from idtool.experiment.black_box import fault_path
from idtool.experiment.runner import run
from idtool.log import Log
from idtool.rig.faults import DeviceGone, NotAnswering, NotFollowing, ServoRestarted, ServoShutdown
from idtool.rig.feetech.servo import AHEAD_S

from ..dynamixel.support import Bench, log_path, recipe

#: A moving axis stands this long after the servo heard the last word: at its goal, and the plant's brake.
STOPS_WITHIN_S = AHEAD_S + 0.5


def _long(*values: object) -> object:
    """A case like one that stays."""
    return pytest.param(*values, marks=pytest.mark.long)


def play(on: Bench, folder: Path, **options: object) -> None:
    with on.rig(speed=2.0) as rig:
        run(recipe(), rig, log_path(folder), confirm=on.setup, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "word", ["lost=0.01", "corrupt=0.01", "burst@3=0.04", *map(_long, ("late=0.01", "twice=0.01"))]
)
def test_what_a_bus_does_to_packets_does_not_stop_a_run(tmp_path: Path, word: str) -> None:
    with Bench(word, seed=3, kind="feetech") as on:
        before = on.table()
        play(on, tmp_path)
        assert sum(on.mishaps.counts.values()) >= 1
        log = Log.read(log_path(tmp_path))
        assert len(log.trials) == 2
        frame = log.frame
        # no reading is damaged, and none belongs to another instant
        assert frame["position_rad"].between(-0.42, 0.42).all()
        assert frame["velocity_rad_s"].abs().max() < 0.75
        way, passed = frame["position_rad"].diff().abs(), frame["time_s"].diff()
        assert (way - 0.7 * passed)[frame["trial"].diff() == 0].max() < 0.012
        assert set(frame["supply_voltage_v"]) == {24.0}
        assert on.table() == before
        assert on.stands(0.3)


@pytest.mark.parametrize(
    ("word", "kind", "sentence"),
    [
        ("burst@3=0.6", NotAnswering, "does not answer at 1000000 baud; check power, cable"),
        _long("silent@3", NotAnswering, "does not answer at 1000000 baud; check power, cable"),
        ("unplugged@3", DeviceGone, "has disappeared"),
        ("power@3", ServoRestarted, "torque went off: it lost its power for a moment"),
        ("overload@3", ServoShutdown, "reports overload"),
        _long("error@3=4", ServoShutdown, "reports overheating"),
        _long("error@3=1", ServoShutdown, "reports supply voltage out of range"),
        ("stuck@3", NotFollowing, "its position does not follow the commands"),
    ],
)  # fmt: skip
def test_what_ends_a_run_ends_it_safely(
    tmp_path: Path, word: str, kind: type[RigFault], sentence: str
) -> None:
    with Bench(word, kind="feetech") as on:
        before = on.table()
        with pytest.raises(kind) as caught:
            play(on, tmp_path)
        assert sentence in str(caught.value)
        assert on.stands(STOPS_WITHIN_S)
        if kind not in (NotAnswering, DeviceGone):
            assert on.table() | {"status": 0} == before
        log = Log.read(log_path(tmp_path))
        assert not log.incomplete
        last = Log.read(fault_path(log_path(tmp_path)))
        assert (last.experiment, last.header["fault"]) == ("fault", kind.__name__)
        assert {"duty", "supply_voltage_v"} <= set(last.frame)


def test_another_program_that_moves_the_servo_is_noticed() -> None:
    with Bench(kind="feetech") as on, on.rig(speed=2.0) as rig:
        from idtool.rig.base import TrialSetup

        rig.prepare(TrialSetup(start_position=0.0, rest_s=0.0))
        rig.step(0.0)
        with on.terminal.lock:
            on.servo.table["goal_position"] = 2100
        with pytest.raises(ServoRestarted, match="another goal than it was given"):
            rig.where()


def test_a_run_goes_on_where_it_ended(tmp_path: Path) -> None:
    with Bench("silent@8", kind="feetech") as on, pytest.raises(NotAnswering):
        play(on, tmp_path)
    first = Log.read(log_path(tmp_path))
    with Bench(kind="feetech") as on:
        play(on, tmp_path, resume=True)
    whole = Log.read(log_path(tmp_path))
    assert len(whole.trials) == 2
    kept = first.frame[first.frame["trial"] == 0]
    assert whole.frame.iloc[: len(kept)].equals(kept)


def test_a_servo_in_error_is_refused_before_it_moves() -> None:
    with Bench(kind="feetech") as on:
        on.servo.fail(0x20)
        with pytest.raises(ServoShutdown, match=r"reports overload .* switch its power off and on"):
            on.rig()
