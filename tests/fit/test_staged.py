"""A fit of one part is as unsure as what it holds of the other parts."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from benchmarks.sessions import log_of, truth
from idtool.fit.joint import JointFit
from idtool.fit.results import dynamic_parameters
from idtool.fit.staged import fit_dynamic
from idtool.parameters import STATIC, Parameter, Parameters
from idtool.signals import record


def fitted(**static: Parameter) -> JointFit:
    """The dynamic fit of two sines, the static parameters declared but for those that are given."""
    log = log_of("sine", 3, (2, 3))
    declared = {name: Parameter(truth()[name]) for name in STATIC}
    known = replace(Parameters(axis=log.axis), static={**declared, **static})
    return fit_dynamic(record([log]), known).fit


def variance(fit: JointFit, name: str) -> float:
    i = fit.model.names.index(name)
    return float(fit.covariance[i, i])


@pytest.mark.parametrize("held", ["viscous", "coulomb", "stribeck_velocity"])
def test_what_is_held_is_carried_on_as_a_fit_with_another_value_moves(held: str) -> None:
    value, error = truth()[held], 0.01 * truth()[held]
    alone = fitted()
    more = math.sqrt(
        variance(fitted(**{held: Parameter(value, error)}), "bristle_damping")
        - variance(alone, "bristle_damping")
    )
    moved = fitted(**{held: Parameter(value + error)}).values["bristle_damping"]
    assert more == pytest.approx(abs(moved - alone.values["bristle_damping"]), rel=0.1)


def test_what_is_not_determined_is_as_unsure_as_its_bounds() -> None:
    value = truth()["viscous"]
    bounded = fitted(viscous=Parameter(value).undetermined(0.9 * value, 1.2 * value))
    unknown = fitted(viscous=Parameter(value).undetermined())
    errors = [
        dynamic_parameters(fit)["bristle_damping"].stderr or 0.0 for fit in (fitted(), bounded, unknown)
    ]
    assert 5.0 * errors[0] < errors[1]
    assert errors[2] == pytest.approx(5.0 * errors[1], rel=0.05)
