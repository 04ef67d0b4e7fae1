"""The position loop of a servo from its goal: gain, delay, and a delay that is too long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log
from idtool.fit.drive import fit_drive
from idtool.parameters.drive import Drive
from testbench.pendulums import Pendulum

SWING = Pendulum()
GAIN = 8.0  # N m/rad


def log_of(delay: float) -> Log:
    log = SWING.log(seconds=10.0, noise=0.0)
    time = log.frame["time_s"]
    goal = log.frame["position_rad"] + SWING.torque_constant * log.frame["current_a"] / GAIN
    early = np.interp(time + delay, time, goal)
    return replace(log, axis=SWING.parameters().axis, rows=log.frame.assign(position_command_rad=early))


def found(delay: float) -> Drive:
    return fit_drive([log_of(delay)])


def test_gain_and_delay_of_the_loop() -> None:
    drive = found(0.02)
    assert drive.position_gain is not None
    assert drive.position_gain.value == pytest.approx(GAIN, rel=0.02)
    assert drive.delay is not None
    assert drive.delay.value == pytest.approx(0.02, abs=2e-3)
    assert not drive.delay.at_bound


def test_a_delay_beyond_what_is_looked_for_sits_at_its_bound() -> None:
    delay, longest = found(0.07).delay, found(0.055).delay
    assert delay is not None
    assert longest is not None
    assert delay.at_bound
    assert not longest.at_bound


def test_the_largest_command_of_gentle_logs_is_no_limit() -> None:
    limit = found(0.02).limit
    assert limit is not None
    assert not limit.identified
    assert limit.at_least == limit.value


def test_a_duty_that_stops_short_of_its_goal_tells_the_limit_and_else_ends_at_one() -> None:
    log = log_of(0.0)
    frame = log.frame.drop(columns="current_a")
    asked = 0.5 * (frame["position_command_rad"] - frame["position_rad"])
    for most, wanted in ((10.0, 1.0), (0.6 * asked.abs().max(), 0.6 * asked.abs().max())):
        by_duty = frame.assign(duty=asked.clip(-most, most), supply_voltage_v=7.4)
        limit = fit_drive([replace(log, axis=Axis(), rows=by_duty)]).limit
        assert limit is not None
        assert limit.value == pytest.approx(wanted)
        assert limit.known


def test_a_servo_that_rests_for_long_tells_its_limit_too() -> None:
    """A duty that is quiet at rest repeats itself there for longer than it stays at its limit."""
    log = log_of(0.0)
    frame = log.frame.drop(columns="current_a")
    asked = 0.5 * (frame["position_command_rad"] - frame["position_rad"])
    most = 0.6 * asked.abs().max()
    moving = frame.assign(duty=asked.clip(-most, most), supply_voltage_v=7.4)
    rest = moving.iloc[[-1] * 800].assign(time_s=moving["time_s"].iloc[-1] + 0.005 * np.arange(1, 801))
    drive = fit_drive([replace(log, axis=Axis(), rows=pd.concat([moving, rest], ignore_index=True))])
    assert drive.limit is not None
    assert drive.limit.value == pytest.approx(most)
    assert drive.position_gain is not None
    assert drive.position_gain.value == pytest.approx(0.5, rel=0.01)
