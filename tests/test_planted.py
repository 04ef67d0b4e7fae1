"""What is added to a recording is what is said."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool.log import Log
from idtool.parameters.axis import Axis
from testbench.planted import SHAPES, planted
from testbench.regression import STANDS_FOR, moving, regress, torque_of


def swinging(effort: str) -> Log:
    """An axis with friction, swung at several sizes and paces; its torque is noisy."""
    time = 0.005 * np.arange(2000)
    rng, trials = np.random.default_rng(0), []
    for number in range(6):
        pace = 2.0 * np.pi * (0.15 + 0.07 * number)
        position = (1.0 - 0.1 * number) * np.sin(pace * time + number)
        speed = np.gradient(position, time)
        torque = 0.5 * np.tanh(speed / 0.01) + 0.2 * speed + 0.01 * rng.normal(size=len(time))
        values = torque if effort == "torque_nm" else torque / 2.0
        trials.append({"trial": number, "time_s": time, "position_rad": position, effort: values})
    frame = pd.concat([pd.DataFrame(trial) for trial in trials], ignore_index=True)
    return Log(frame, Axis(torque_constant=2.0))


@pytest.mark.parametrize("effort", ["torque_nm", "current_a"])
@pytest.mark.parametrize("effect", list(SHAPES))
def test_what_is_planted_has_its_size_and_is_found_by_least_squares(effect: str, effort: str) -> None:
    log = swinging(effort)
    spoilt = planted(log, effect, 0.1, np.random.default_rng(1))
    added = torque_of(spoilt) - torque_of(log)
    assert np.sqrt(np.mean(added**2)) == pytest.approx(0.1)
    before, after = (regress(moving(one, {}), False).found for one in (log, spoilt))
    constant = {"torque_offset", "direction_asymmetry"}
    true = constant if effect in constant else {effect}
    assert true & {name for term in after for name in STANDS_FOR[term.name]}
    assert not true & {name for term in before for name in STANDS_FOR[term.name]}


def test_a_log_without_a_position_is_refused() -> None:
    log = swinging("torque_nm")
    blind = Log(log.frame.rename(columns={"position_rad": "velocity_rad_s"}), log.axis)
    with pytest.raises(ValueError, match="position"):
        planted(blind, "torque_offset", 0.1, np.random.default_rng(0))
