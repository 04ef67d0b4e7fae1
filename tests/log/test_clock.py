"""Clocks that no servo was recorded with: where each limit lies."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, InputError, Log
from idtool.log.clock import doubts, refuse_odd_clock


def refused(time: np.ndarray) -> str:
    """What is said of a clock, "" if it is taken."""
    log = Log(pd.DataFrame({"trial": 0, "time_s": time}), Axis("rotary", 1.0))
    try:
        refuse_odd_clock(log, time, np.arange(len(time)) == 0)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("step", "said"),
    [(1.1, "milli-"), (0.9, ""), (1.2e-6, ""), (0.8e-6, "hours or days")],
)
def test_rates_at_which_a_servo_is_recorded(step: float, said: str) -> None:
    found = refused(step * np.arange(100))
    assert said in found
    assert bool(said) == bool(found)


@pytest.mark.parametrize(
    ("pauses", "share", "bursts"), [(24, 0.08, True), (24, 0.12, False), (18, 0.08, False)]
)
def test_a_clock_of_packets_comes_in_bursts(pauses: int, share: float, bursts: bool) -> None:
    """`share` of the time is between rows of one packet."""
    steps = np.full(30 * pauses, 1e-3)
    steps[::30] = 1e-3 * 29.0 * (1.0 / share - 1.0)
    assert ("comes in bursts" in refused(np.cumsum(np.append(0.0, steps)))) == bursts


@pytest.mark.parametrize(("step", "said"), [(2e-5, True), (3e-5, False)])
def test_no_current_loop_is_faster(step: float, said: bool) -> None:
    time = step * np.arange(100)
    assert any("faster than the current loop" in one for one in doubts(time, time == 0.0)) == said
