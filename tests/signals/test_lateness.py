"""A speed that a servo reports late is told by how much."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log
from idtool.signals.lateness import velocity_lateness, without_late_velocity


def motion(late: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time = np.arange(0.0, 6.0, 0.005)
    speed = np.interp(time - late, time, np.sin(3.0 * time) + 0.3 * np.sin(11.0 * time))
    return time, -np.cos(3.0 * time) / 3.0 - 0.3 * np.cos(11.0 * time) / 11.0, speed


@pytest.mark.parametrize("late", [0.012, 0.02, 0.04])
def test_its_lateness(late: float) -> None:
    assert velocity_lateness(*motion(late)) == pytest.approx(late, abs=0.003)


def test_none_where_it_is_of_the_same_instant() -> None:
    assert velocity_lateness(*motion(0.0)) == 0.0
    time, position, velocity = motion(0.0)
    assert velocity_lateness(time, position, 0.0 * velocity) == 0.0


def test_a_late_column_is_left_out_and_said() -> None:
    time, position, velocity = motion(0.02)
    frame = pd.DataFrame(
        {
            "trial": 0,
            "time_s": time,
            "position_rad": position,
            "velocity_rad_s": velocity,
            "torque_nm": np.sin(time),
        }
    )
    (log,), (note,) = without_late_velocity([Log(frame, Axis())])
    assert log.column("velocity") is None
    assert "20 ms later" in note
    prompt = Log(frame.assign(velocity_rad_s=motion(0.0)[2]), Axis())
    assert without_late_velocity([prompt]) == ([prompt], [])


def test_it_is_looked_for_up_to_what_filters_do() -> None:
    """0.08 s: a speed that is later still is not what a servo's own filter makes of it."""
    assert velocity_lateness(*motion(0.075)) == pytest.approx(0.075, abs=0.003)
    assert velocity_lateness(*motion(0.11)) <= 0.08


@pytest.mark.parametrize(("late", "told"), [(0.0060, False), (0.0095, True)])
def test_a_sample_and_a_half_is_no_lateness(late: float, told: bool) -> None:
    """A sample is 5 ms here: by so much a speed differs that is the difference of two positions."""
    assert (velocity_lateness(*motion(late)) > 0.0) == told
