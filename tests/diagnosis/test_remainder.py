"""A fit of one part knows when its model is wrong, and its intervals allow for that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.diagnosis.remainder import doubted, remainder
from idtool.fit.staged import StaticFit, fit_static
from idtool.parameters import Axis, Parameters
from idtool.signals import record
from testbench.plants import TORQUE_CONSTANT, Plant, record_session

CLEAN = Plant(0.080, 0.115, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)
LACKING = {
    "ripple": {
        "position_ripple": {
            "cycles_per_turn": 24.0,
            "amplitude_1_nm": 0.012,
            "phase_1_rad": 0.7,
            "amplitude_2_nm": 0.003,
            "phase_2_rad": -1.1,
        }
    },
    "spring": {"position_stiffness": {"stiffness_nm_per_rad": 0.03, "neutral_rad": 0.4}},
    "asymmetry": {"direction_asymmetry": {"asymmetry_nm_s_per_rad": 0.03}},
}


def static(plant: Plant, seed: int) -> StaticFit:
    logs = record_session(plant, "lab", seed, ("sweep",))
    return fit_static(record(logs), Parameters(axis=Axis("rotary", TORQUE_CONSTANT)))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_silent_and_without_a_doubt_where_nothing_is_lacking(seed: int) -> None:
    fit = static(CLEAN, seed).fit
    assert remainder(fit) is None
    assert doubted(fit, None) is fit


@pytest.mark.parametrize(
    "lacking", ["ripple", *(pytest.param(one, marks=pytest.mark.long) for one in ("spring", "asymmetry"))]
)
def test_says_so_and_widens_where_an_effect_is_lacking(lacking: str) -> None:
    fit = static(replace(CLEAN, effects=LACKING[lacking]), 5).fit
    left = remainder(fit)
    assert left is not None
    assert left.depends_on
    wide = doubted(fit, left)
    np.testing.assert_array_equal(wide.x, fit.x)
    names = fit.model.names
    for name in ("coulomb", "viscous"):
        place = names.index(name)
        truth = getattr(CLEAN, name) if name == "viscous" else np.log(CLEAN.coulomb)
        before, after = (np.sqrt(one.covariance[place, place]) for one in (fit, wide))
        assert after >= before
        assert abs(fit.x[place] - truth) < wide.quantile[place] * after
