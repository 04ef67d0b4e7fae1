"""What is added to a recording is what is said."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool.log import Log
from idtool.parameters.axis import Axis
from testbench.planted import EFFECTS, LATE_S, SHAPES, planted
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
def test_what_is_planted_has_its_size(effect: str, effort: str) -> None:
    log = swinging(effort)
    added = torque_of(planted(log, effect, 0.1, np.random.default_rng(1))) - torque_of(log)
    assert np.sqrt(np.mean(added**2)) == pytest.approx(0.1)


#: Those of which the regression has a column on an axis without a load.
_COLUMNS = [
    "torque_offset",
    "direction_asymmetry",
    "position_stiffness",
    "position_ripple",
    "position_dependent_friction",
    "nonlinear_viscous",
]


@pytest.mark.parametrize("effect", _COLUMNS)
def test_what_is_planted_is_found_by_least_squares(effect: str) -> None:
    log = swinging("torque_nm")
    spoilt = planted(log, effect, 0.1, np.random.default_rng(1))
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


@pytest.mark.parametrize("effort", ["torque_nm", "current_a"])
def test_a_late_torque_is_that_of_earlier_rows_of_its_trial(effort: str) -> None:
    log, rows = swinging(effort), round(LATE_S / 0.005)
    before, after = torque_of(log), torque_of(planted(log, "transport_delay", 0.1, np.random.default_rng(0)))
    for number in range(6):
        trial = slice(2000 * number, 2000 * (number + 1))
        assert after[trial][rows:] == pytest.approx(before[trial][:-rows])
        assert after[trial][:rows] == pytest.approx(before[trial][0])


def test_what_slips_follows_the_way_and_not_the_speed() -> None:
    log = swinging("torque_nm")
    shape = torque_of(planted(log, "hysteresis", 0.1, np.random.default_rng(0))) - torque_of(log)
    position = log.column("position")
    assert position is not None
    still = np.abs(np.diff(position)) < 1e-12
    assert np.all(np.diff(shape)[still] == pytest.approx(0.0, abs=1e-9))
    assert np.max(shape) == pytest.approx(-np.min(shape))
    assert set(EFFECTS) > set(SHAPES)
