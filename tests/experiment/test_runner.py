"""The runner: refuses before it moves, stops what leaves its limits, and keeps whole logs."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from idtool.errors import InputError, RigFault
from idtool.experiment.recipe import Recipe, parse_recipe, read_recipe
from idtool.experiment.runner import Progress, RunSummary, run
from idtool.log import Log
from idtool.rig import open_rig
from idtool.rig.base import Block, Limits
from idtool.rig.supervisor import LoopTime

from .double import RigDouble, spoil

TEXT = """
schema = "ffc-id/recipe/1"
name = "mine"
experiment = "sweep"
[setup]
tilt_alpha_rad = 1.5
[[trials]]
kind = "back_and_forth"
payload_kg = [0.0, 0.4]
speed_rad_s = 0.5
travel_rad = 1.0
"""


def recipe(change: Callable[[str], str] = str) -> Recipe:
    return parse_recipe(change(TEXT), "mine.toml")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return tmp_path / "log.csv"


def test_a_whole_run(log: Path) -> None:
    rig = RigDouble()
    seen: list[Progress] = []
    summary = run(recipe(), rig, log, progress=seen.append)
    read = Log.read(log)
    seconds = float(np.ptp(read.frame["time_s"]))
    samples = round(recipe().duration_s / rig.period_s)
    assert (summary.loop.samples, summary.loop.overruns) == (pytest.approx(samples, abs=4), 0)
    assert replace(summary, duration_s=0.0, loop=LoopTime()) == RunSummary(
        str(log), len(read.frame), 2, 0.0, False
    )
    assert summary.duration_s == pytest.approx(seconds)
    assert list(read.frame.columns) == [
        "trial", "time_s", "position_rad", "velocity_rad_s", "current_a", "velocity_command_rad_s",
        "payload_kg", "tilt_alpha_rad", "tilt_beta_rad",
    ]  # fmt: skip
    assert (read.experiment, read.header) == ("sweep", {"recipe": "mine", "rig": "a double"})
    assert [float(trial["payload_kg"].iloc[0]) for trial in read.trials] == [0.0, 0.4]
    assert rig.calls == ["prepare", "play", "prepare", "play", "stop"]
    # the travel lies in the middle of the range
    assert read.frame["position_rad"].min() == pytest.approx(-0.5, abs=0.01)
    assert read.frame["position_rad"].max() == pytest.approx(0.5, abs=0.01)
    assert [now.share for now in seen] == sorted(now.share for now in seen)
    assert seen[-1].share == pytest.approx(1.0, abs=0.01)
    assert seen[-1].rig_s_left == pytest.approx(0.0, abs=0.1)
    assert seen[0].rig_s_left == pytest.approx(recipe().duration_s, abs=0.3)
    assert (seen[0].trial, seen[-1].trial, seen[-1].trials) == (1, 2, 2)
    assert all(now.wall_s_left >= 0 for now in seen)


@pytest.mark.parametrize("every", [1, 2, 5])
def test_rows_come_at_the_period_of_the_recipe(log: Path, every: int) -> None:
    slow = replace(recipe(), period_s=0.005 * every)
    seen: list[Progress] = []
    run(slow, RigDouble(), log, progress=seen.append)
    for trial in Log.read(log).trials:
        assert np.diff(trial["time_s"]) == pytest.approx(0.005 * every)
        assert trial["velocity_rad_s"].to_numpy() == pytest.approx(trial["velocity_command_rad_s"].to_numpy())
    assert 0.4 < seen[len(seen) // 2].share < 0.6


def test_temperature_and_a_linear_axis(log: Path) -> None:
    metres = TEXT.replace("speed_rad", "speed_m").replace("travel_rad", "travel_m")
    linear = parse_recipe(metres.replace("[setup]", 'axis = "linear"\n[setup]'), "mine.toml")
    run(linear, RigDouble(kind="linear", temperature=True), log)
    read = Log.read(log)
    assert {"position_m", "velocity_m_s", "velocity_command_m_s", "temperature_degc"} <= set(read.frame)
    with pytest.raises(InputError, match='axis: is for a linear axis and the rig is rotary; write axis = "'):
        run(linear, RigDouble(), log, force=True)


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        (Limits((-0.3, 0.3), 1.2, 1.0), r"trials\[0\].travel_rad: moves over 1 rad, the rig has 0.6"),
        (Limits((-2.0, 2.0), 0.4, 1.0), r"\[0\].speed_rad_s: moves at 0.5 rad/s, the rig's limit is 0.4"),
    ],
)  # fmt: skip
def test_limits_refuse_before_anything_moves(log: Path, limits: Limits, expected: str) -> None:
    rig = RigDouble(limits=limits)
    with pytest.raises(InputError, match=expected):
        run(recipe(), rig, log)
    assert rig.calls == []
    assert not log.exists()


def test_a_bad_last_trial_refuses_the_whole_run(log: Path) -> None:
    rig = RigDouble()
    with pytest.raises(InputError, match=r"trials\[1\].amplitude_rad_s"):
        run(
            recipe(lambda text: text + '[[trials]]\nkind = "sine"\nfrequency_hz = 0.05\n'
                   "amplitude_rad_s = 1.0\nduration_s = 40\n"), rig, log,
        )  # fmt: skip
    assert rig.calls == []


def test_a_rig_too_slow_for_a_sine_says_so(log: Path) -> None:
    fast = recipe(lambda text: text + '[[trials]]\nkind = "sine"\nfrequency_hz = 4\n'
                  "amplitude_rad_s = 0.5\nduration_s = 2\n")  # fmt: skip
    rig = RigDouble(period_s=0.05)
    with pytest.raises(InputError, match="a sine of 4 Hz, more than a tenth of this rig's 20 samples"):
        run(fast, rig, log)
    assert rig.calls == []


@pytest.mark.parametrize(
    ("readings", "expected"),
    [
        ({"position": 2.6}, "its position of 2.6 rad at"),
        ({"position": -2.6}, "its position of -2.6 rad at"),
        ({"velocity": -1.3}, "its velocity of -1.3 rad/s at"),
        ({"current": 1.6}, "its current of 1.6 A at"),
        ({"temperature": 81.0}, "its temperature of 81 °C at"),
        ({"current": float("nan")}, "a sensor returned something that is no number"),
        ({"time_s": float("inf")}, "a sensor returned something that is no number"),
    ],
)
def test_what_leaves_its_limits_is_stopped(log: Path, readings: dict[str, float], expected: str) -> None:
    rig = RigDouble(change=spoil(3, **readings), temperature=True)
    with pytest.raises(RigFault) as caught:
        run(recipe(), rig, log)
    sentence = str(caught.value)
    assert expected in sentence
    assert rig.calls[:3] == ["prepare", "play", "stop"]
    assert set(rig.calls[2:]) == {"stop"}
    rows = len(Log.read(log).frame)
    assert sentence.endswith(
        f"the {rows} rows up to there are in {log}, and the last second at full rate is in "
        f"{log.with_name('log.fault.csv')}."
    )
    # a reading beyond a limit is evidence and is kept; one that is no number cannot be
    assert rows == (3 if "no number" in expected else 4) * 47


def test_a_fault_before_the_first_row_leaves_no_log(log: Path) -> None:
    rig = RigDouble(change=spoil(0, position=float("nan")))
    with pytest.raises(RigFault, match="no row was measured and no log is left"):
        run(recipe(), rig, log)
    assert not log.exists()


def test_a_drive_that_faults_keeps_its_log(log: Path) -> None:
    """The simulated drive stops itself when a payload is more than it can hold."""
    heavy = recipe(lambda text: text.replace("0.4", "40").replace("1.5", "0.0"))
    with (
        open_rig("sim:paper") as rig,
        pytest.raises(RigFault, match=r"cannot hold this payload.* rows up to"),
    ):
        run(heavy, rig, log)
    assert len(Log.read(log).trials) == 1


def test_an_existing_log_stays(log: Path) -> None:
    log.write_text("mine")
    rig = RigDouble()
    with pytest.raises(InputError, match="already exists; pass force=True"):
        run(recipe(), rig, log)
    assert log.read_text() == "mine"
    assert rig.calls == []
    run(recipe(), rig, log, force=True)
    assert Log.read(log).experiment == "sweep"


@pytest.mark.parametrize("at", [0, 1, 5])
def test_ctrl_c_stops_the_axis_and_leaves_a_valid_log(log: Path, at: int) -> None:
    def press(index: int, block: Block) -> Block:
        if index == at:
            os.kill(os.getpid(), signal.SIGINT)
        return block

    rig = RigDouble(change=press)
    summary = run(recipe(), rig, log)
    assert summary.interrupted
    assert summary.rows == 47 * at
    assert rig.calls[-1] == "stop"
    if at:
        assert len(Log.read(log).frame) == summary.rows
    else:
        assert not log.exists()


def test_ctrl_c_while_stopping_still_stops(log: Path) -> None:
    stopped = []

    class Slow(RigDouble):
        def stop(self) -> None:
            os.kill(os.getpid(), signal.SIGINT)
            stopped.append(True)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        run(recipe(), Slow(), log)
    assert stopped == [True]
    assert signal.getsignal(signal.SIGINT) is before
    assert len(Log.read(log).trials) == 2


def test_the_log_of_a_simulation_holds_nothing_of_the_truth(log: Path) -> None:
    with open_rig("sim:bench") as rig:
        run(replace(read_recipe("sine"), trials=read_recipe("sine").trials[-1:]), rig, log)
    header = [line for line in log.read_text().splitlines() if line.startswith("#")]
    assert header == [
        "# ffc-id-log = 1",
        '# experiment = "sine"',
        '# recipe = "sine"',
        '# rig = "simulated: geared test bench with a slide as load"',
        "#",
        "# [axis]",
        '# kind = "rotary"',
        "# torque_constant_nm_per_a = 2.67",
    ]
