"""An element beside the bristle, or one that carries a part of the friction: the same torque."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from idtool.effects.hysteresis import Hysteresis
from idtool.model.motion import Motion
from idtool.model.torque import Friction, predict

BESIDE = Friction(0.05, 0.07, 0.1, 0.2, 3.0, 0.1)
YIELD = 0.03
VALUES = {"yield": YIELD, "log_reach": math.log(0.1)}
PART = VALUES | {"of_friction": 1.0}


def test_part_of_the_friction_is_the_same_as_beside_less_of_it() -> None:
    t = np.linspace(0.0, 12.0, 1200)
    motion = Motion(t, np.zeros(1200, dtype=int), np.sin(t), np.cos(t), -np.sin(t))
    whole = replace(BESIDE, coulomb=BESIDE.coulomb + YIELD, static=BESIDE.static + YIELD)
    one = predict(motion, BESIDE, Hysteresis().contribute(motion, VALUES), np.zeros(1)).torque
    other = predict(motion, whole, Hysteresis(True).contribute(motion, PART), np.zeros(1)).torque
    np.testing.assert_allclose(one, other, atol=1e-12)


def test_a_file_says_which() -> None:
    for values in (VALUES, PART):
        parameters = Hysteresis().to_parameters(values)
        assert parameters.get("of_friction", 0.0) == values.get("of_friction", 0.0)
        assert Hysteresis().to_values(parameters) == pytest.approx(values)


@pytest.mark.parametrize(("part", "beside"), [(0.03, True), (0.05, False)])
def test_what_is_small_beside_the_rest_is_an_element_of_its_own(part: float, beside: bool) -> None:
    model = {"coulomb": 0.1, "static": 0.15}
    found = Hysteresis(True).plainer(PART | {"yield": part}, model)
    if beside:
        assert found is not None
        effect, others = found
        assert effect == Hysteresis()
        assert others == pytest.approx({"coulomb": 0.07, "static": 0.12})
    else:
        assert found is None
    assert Hysteresis().plainer(VALUES, model) is None
