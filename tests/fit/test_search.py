"""The search's cost, by normal equations, is that of the model at the values that it gives."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.sessions import truth
from idtool.fit.model import JointModel
from idtool.fit.search import Projection, search
from tests.fit.test_fit_model import model, rested


@pytest.mark.parametrize("stretches", ["trials", "rests"])
@pytest.mark.parametrize("held", [True, False])
def test_cost_is_that_of_the_model(stretches: str, held: bool) -> None:
    joint = model() if stretches == "trials" else rested()
    joint = JointModel.build(joint.recording, replace(joint.spec, soft=True))  # as the axis of the paper
    known = truth()
    projection = Projection(joint, known["coulomb"] if held else None)
    shape = {
        "bend": known["static"] / known["bristle_stiffness"],
        "ratio": known["static"] / known["coulomb"],
        "stribeck_velocity": known["stribeck_velocity"],
    }
    cost, values = projection.solve(shape)
    if held:
        assert values["coulomb"] == pytest.approx(known["coulomb"])
    assert values["static"] / values["coulomb"] == pytest.approx(shape["ratio"])
    x = joint.coordinates({name: values[name] for name in joint.names})
    level = max(values["coulomb"], values["static"]) / values["bristle_stiffness"]
    # the prior is as wide as for a typical friction level
    bend = level * projection._typical / (values["coulomb"] * projection.medium_level(shape))
    direct = joint.evaluate(x, bend).stacked
    assert cost == pytest.approx(float(direct @ direct), rel=1e-2)
    # and no other values of what is linear do better
    for name in ("viscous", "bristle_damping", "inertia.inertia"):
        for factor in (0.97, 1.03):
            other = joint.coordinates({n: values[n] * (factor if n == name else 1.0) for n in joint.names})
            worse = joint.evaluate(other, bend).stacked
            assert float(worse @ worse) > 0.999 * cost


def test_any_whole_number_is_a_seed() -> None:
    joint = model()
    best = [search(joint, optimizer="esch", evaluations=5, seed=seed)[0] for seed in (7, 2**32 + 7, 10**40)]
    assert best[0].cost == best[1].cost
    assert best[2].cost > 0.0
