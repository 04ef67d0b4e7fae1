"""The level at which an axis slides whose friction is carried by an element that slips."""

from __future__ import annotations

from dataclasses import replace

import pytest

from idtool.diagnosis.candidates import best_start, try_effect
from idtool.diagnosis.level import told_by_its_level
from idtool.effects.hysteresis import Hysteresis
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.fit.results import static_parameters
from tests.diagnosis.conftest import LEVEL


@pytest.fixture(scope="module")
def carried(slipping: JointFit) -> JointFit:
    part = Hysteresis(of_friction=True)
    return try_effect(slipping, part, best_start(slipping, part), far=True).fit


def test_a_coulomb_level_below_what_elements_carry_is_that(carried: JointFit) -> None:
    """It was printed 5 % too low, with an interval of 1 %: nothing in the rows tells it then."""
    values = {**carried.values, "hysteresis.yield": LEVEL, "coulomb": 0.9 * LEVEL}
    below = replace(carried, x=carried.model.coordinates(values))
    told = told_by_its_level(below)
    coulomb = static_parameters(told)["coulomb"]
    assert coulomb.ci95 is not None
    low, high = coulomb.ci95
    assert low < LEVEL < high
    assert high - low < 0.05 * LEVEL
    assert told.values["hysteresis.yield"] < told.values["coulomb"]
    assert told.sse < 1.02 * carried.sse
    assert told.outcome.converged


def test_a_curve_without_a_level_at_rest_has_one_to_slide_at(carried: JointFit) -> None:
    """Coulomb friction beside an element: seen in a recording of a cable-driven joint."""
    model = carried.model
    plain = JointModel.build(model.recording, replace(model.spec, friction="coulomb"), model.constants)
    fit = refit(carried, plain)
    values = {**fit.values, "hysteresis.yield": LEVEL, "coulomb": 0.9 * LEVEL}
    told = told_by_its_level(replace(fit, x=plain.coordinates(values)))
    assert told.values["hysteresis.yield"] == pytest.approx(LEVEL, rel=0.03)
    assert told.outcome.converged


def test_a_fit_that_has_it_already_stays(carried: JointFit, slipping: JointFit) -> None:
    part = carried.values["hysteresis.yield"]
    above = replace(carried, x=carried.model.coordinates({**carried.values, "coulomb": 1.1 * part}))
    assert told_by_its_level(above) is above
    assert told_by_its_level(slipping) is slipping
