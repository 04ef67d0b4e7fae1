"""Logs as one recording: how many rows it takes, and which of them count."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool.errors import InputError
from idtool.log import Log
from idtool.parameters.axis import Axis
from idtool.signals import record

STEP = 0.01


def log(rows: int, spike: float = 0.0) -> Log:
    """A swing with noise of 0.05 N m, and a spike of the torque in the middle of it."""
    time = np.arange(rows) * STEP
    torque = np.sin(time) + 0.05 * np.random.default_rng(0).standard_normal(rows)
    torque[rows // 2] = np.sin(time[rows // 2]) + spike
    return Log(
        pd.DataFrame({"trial": 0, "time_s": time, "position_rad": np.sin(2.0 * time), "torque_nm": torque}),
        Axis(),
    )


def test_fifty_rows_are_the_fewest() -> None:
    with pytest.raises(InputError, match="only 49 rows; a fit needs 50 at least"):
        record([log(49)])
    assert len(record([log(50)]).motion) == 50


@pytest.mark.parametrize(("spike", "counts"), [(0.35, False), (0.5, True)])
def test_a_spike_is_an_outlier_where_noise_does_not_come(spike: float, counts: bool) -> None:
    """Eight standard deviations of it."""
    assert record([log(1000, spike)]).lost == ({"outlier of the torque": 1} if counts else {})


@pytest.mark.parametrize(("seconds", "left_out"), [(0.97, 0), (1.03, 10)])
def test_the_ends_of_a_long_trial_depend_on_motion_nobody_logged(seconds: float, left_out: int) -> None:
    """A reading may be late by 0.05 s; a trial of twenty times that can spare both ends."""
    usable = record([log(round(seconds / STEP) + 1)]).usable
    assert np.count_nonzero(~usable) == left_out
    if left_out:
        assert usable[5:-5].all()


def test_a_trial_that_begins_in_fast_motion_does_not_begin_with_a_jerk() -> None:
    """Without a column of the speed: a motor of 100 rad/s was read to start from a speed of a robot, and a
    prediction of its first rows was nine times the largest torque that was measured."""
    time = STEP * np.arange(600)
    rows = {"trial": 0, "time_s": time, "position_rad": 100.0 * time + np.sin(time), "torque_nm": 1.0 + time}
    motion = record([Log(pd.DataFrame(rows), Axis())]).motion
    assert motion.velocity[:5] == pytest.approx(100.0 + np.cos(time[:5]), abs=0.5)
    assert np.max(np.abs(motion.acceleration)) < 10.0


def test_a_calculated_torque_has_the_noise_of_its_digits() -> None:
    """A weight is never over nothing: what is known without noise would divide by zero."""
    time = STEP * np.arange(2000)
    frame = pd.DataFrame({"trial": 0, "time_s": time, "position_rad": np.sin(time), "torque_nm": 2.0 + time})
    size = float(np.sqrt(np.mean((2.0 + time) ** 2)))
    assert record([Log(frame, Axis())]).noise == pytest.approx(1e-12 * size)
