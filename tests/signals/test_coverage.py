"""What a recording covers: where the lines are drawn between motion, rest and constant speed."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from idtool.log import Log
from idtool.model.motion import Array, Motion
from idtool.parameters.axis import Axis
from idtool.signals import record
from idtool.signals.coverage import constant_speeds, constant_tilt, long_enough, moves_one_way

STEP = 0.01


def moving(velocity: Array, gravity_factor: Array | None = None) -> Motion:
    time = np.arange(len(velocity)) * STEP
    trial = np.zeros(len(velocity), dtype=np.intp)
    still = np.zeros(len(velocity))
    return Motion(time, trial, np.cumsum(velocity) * STEP, velocity, still, gravity_factor=gravity_factor)


@pytest.mark.parametrize(("change", "constant"), [(0.09, True), (0.11, False)])
def test_a_tilt_that_changes_gravity_by_a_tenth_is_another_tilt(change: float, constant: bool) -> None:
    factor = 1.0 - change * np.linspace(0.0, 1.0, 100)
    assert constant_tilt(moving(np.ones(100), factor)) == constant


def test_without_a_tilt_gravity_acts_alike() -> None:
    assert constant_tilt(moving(np.ones(100)))


@pytest.mark.parametrize(
    ("back", "rows", "one_way"), [(0.04, 200, True), (0.06, 200, False), (0.06, 15, True), (0.06, 25, False)]
)
def test_what_creeps_back_does_not_go_both_ways(back: float, rows: int, one_way: bool) -> None:
    """A twentieth of the highest speed is motion, and a fiftieth of the rows a way."""
    velocity = np.concatenate([np.ones(1000), np.full(rows, -back)])
    recording: Any = SimpleNamespace(motion=moving(velocity), usable=np.ones(len(velocity), dtype=bool))
    assert moves_one_way(recording) == one_way


@pytest.mark.parametrize(
    ("slow", "seconds", "usable", "counts"),
    [
        (0.3, 0.85, 1.0, True),
        (-0.3, 0.85, 1.0, True),
        (0.3, 0.75, 1.0, False),
        (0.03, 1.0, 1.0, True),
        (0.3, 1.0, 0.4, False),
        (0.3, 1.0, 0.6, True),
    ],
)
def test_what_a_constant_speed_is(slow: float, seconds: float, usable: float, counts: bool) -> None:
    """However slow it is; as much as a settling time is lost where it changes."""
    rows = round(seconds / STEP)
    velocity = np.concatenate([np.ones(100), np.full(rows, slow), np.ones(100)])
    flags = np.ones(len(velocity), dtype=bool)
    flags[100 + round(usable * rows) : 100 + rows] = False
    recording: Any = SimpleNamespace(motion=moving(velocity), usable=flags, moving=np.abs(velocity) > 0.02)
    assert constant_speeds(recording) == pytest.approx([1.0, slow, 1.0] if counts else [1.0, 1.0])


def test_no_rows_make_no_stretch() -> None:
    """At the end of the last trial too."""
    recording: Any = SimpleNamespace(motion=moving(np.ones(100)), usable=np.ones(100, dtype=bool))
    assert long_enough(recording, 50, 100)
    assert not long_enough(recording, 100, 100)


def test_what_trembles_or_stands_is_no_constant_speed() -> None:
    velocity = np.concatenate([np.ones(100), np.zeros(200), 1.0 + 0.3 * np.sin(np.arange(300) / 10.0)])
    recording: Any = SimpleNamespace(
        motion=moving(velocity), usable=np.ones(600, dtype=bool), moving=velocity > 0.02
    )
    assert constant_speeds(recording) == pytest.approx([1.0])


def test_an_axis_moves_for_certain_above_a_fiftieth_of_its_top_speed() -> None:
    log = pd.DataFrame({"trial": 0, "time_s": np.arange(2000) * STEP})
    speed = np.where(log["time_s"] < 10.0, 1.0, np.where(log["time_s"] < 15.0, 0.025, 0.015))
    log = log.assign(
        position_rad=np.cumsum(speed) * STEP, torque_nm=0.1 * speed + 0.01 * np.sin(log["time_s"])
    )
    moving = record([Log(log, Axis())]).moving
    assert moving[:990].all()
    assert moving[1020:1480].all()
    assert not moving[1520:].any()
