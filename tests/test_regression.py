"""The regression of `make study-measured` finds what is there, and nothing on an axis that has nothing."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from pages.measured import unconfirmed, unnamed
from testbench.regression import held_out, moving, regress, relative

TIME = np.arange(0.0, 40.0, 0.01)
WAVES = 3.7


def motion(seed: int) -> tuple[Array, Array, Array]:
    """Two sines of uneven periods: position, velocity, acceleration."""
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 2)
    found = np.zeros((3, len(TIME)))
    for size, omega, start in zip((0.8, 0.3), (0.7, 1.9), phase, strict=True):
        angle = omega * TIME + start
        found += size * np.array([np.sin(angle), omega * np.cos(angle), -(omega**2) * np.sin(angle)])
    return found[0], found[1], found[2]


def log_of(seed: int, offset: float = 0.0, ripple: float = 0.0, noise: float = 0.02) -> Log:
    position, velocity, acceleration = motion(seed)
    torque = np.tanh(velocity / 1e-3) + 0.5 * velocity + 0.3 * acceleration + offset
    torque += ripple * np.sin(2.0 * np.pi * WAVES * position)
    torque += noise * np.random.default_rng(seed + 100).standard_normal(len(TIME))
    columns = {"time_s": TIME, "position_rad": position, "velocity_rad_s": velocity, "torque_nm": torque}
    return Log(pd.DataFrame({"trial": 0} | columns), Axis())


@pytest.mark.parametrize("seed", range(10))
def test_finds_nothing_worth_naming_on_a_plain_axis(seed: int) -> None:
    rows = moving(log_of(seed))
    found = regress(rows, gravity=False)
    assert found.coulomb == pytest.approx(1.0, rel=0.03)
    assert all(term.size < 0.02 * found.coulomb for term in found.found if term.name != "inertia")
    assert found.held_out < 3.0


@pytest.mark.parametrize("seed", range(5))
def test_finds_an_offset_and_a_ripple_and_how_large_they_are(seed: int) -> None:
    rows = moving(log_of(seed, offset=0.15, ripple=0.2))
    found = regress(rows, gravity=False)
    sizes = {term.name: term.size for term in found.found if term.size > 0.05}
    assert sizes.pop("inertia") > 0.05
    assert sizes == pytest.approx({"offset": 0.15, "line": 0.2 / np.sqrt(2.0)}, rel=0.15)
    (line,) = (term.said for term in found.found if term.name == "line" and term.size > 0.05)
    assert float(line.split()[2]) == pytest.approx(WAVES, rel=0.01)


def test_held_out_rows_are_whole_trials_or_blocks_of_time() -> None:
    one = log_of(0)
    assert 0.15 < np.mean(held_out(one)) < 0.22
    assert np.sum(np.diff(held_out(one).astype(int)) == 1) == 3
    frames = [one.frame.assign(trial=k) for k in range(6)]
    many = Log(pd.concat(frames, ignore_index=True), one.axis)
    assert set(many.frame["trial"][held_out(many)]) == {2}


def test_error_of_a_prediction_is_that_of_moving_rows_alone() -> None:
    log = log_of(0, noise=0.0)
    torque = log.frame["torque_nm"].to_numpy()
    rows = moving(log, {"less": 0.97 * torque})
    assert relative(rows, rows.others["less"]) == pytest.approx(3.0, rel=1e-6)
    assert np.min(np.abs(rows.velocity)) > 0.03
    assert len(rows.time) < 0.35 * len(TIME)


def test_a_column_is_named_by_any_effect_that_stands_for_it() -> None:
    terms = [
        {"name": name, "said": name, "percent_of_coulomb": share}
        for name, share in (("abs w", 9.0), ("s q", 8.0), ("offset", 4.0), ("Stribeck 3 %", 20.0))
    ]
    one = {
        "effects": [{"name": "direction_asymmetry", "alternatives": []}],
        "friction": "stribeck",
        "regression": {"found": terms},
    }
    assert [term["name"] for term in unnamed(one)] == ["s q"]
    assert [term["name"] for term in unnamed(one | {"friction": "coulomb"})] == ["s q", "Stribeck 3 %"]


def test_a_name_is_confirmed_by_any_column_that_stands_for_it() -> None:
    named = ("inertia", "position_ripple", "thermal_drift", "hysteresis", "nonlinear_viscous")
    terms = [{"name": "line s"}, {"name": "Stribeck 3 %"}]
    one = {"effects": [{"name": name} for name in named], "regression": {"found": terms}}
    assert unconfirmed(one) == ["thermal_drift", "nonlinear_viscous"]
