"""The position loop of a servo from its goal: gain, delay, and a delay that is too long."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool import Log
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
    return replace(log, axis=SWING.parameters().axis, frame=log.frame.assign(position_command_rad=early))


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
    delay = found(0.1).delay
    assert delay is not None
    assert delay.at_bound
