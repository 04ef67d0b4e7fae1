"""An element beside the bristle, or one that carries a part of the friction: the same torque."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.effects.hysteresis import Hysteresis
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion
from idtool.model.torque import Friction, predict
from idtool.verbs.identify import identify

BESIDE = Friction(0.05, 0.07, 0.1, 0.2, 3.0, 0.1)
YIELD = 0.03
VALUES = {"yield": YIELD, "log_reach": math.log(0.1)}
PART = VALUES | {"of_friction": 1.0}
TWO = {"yield_2": 0.01, "log_reach_2": math.log(0.4)}


@pytest.mark.parametrize(("more", "carried"), [({}, YIELD), (TWO, YIELD + 0.01)], ids=["one", "two"])
def test_part_of_the_friction_is_the_same_as_beside_less_of_it(
    more: dict[str, float], carried: float
) -> None:
    t = np.linspace(0.0, 12.0, 1200)
    motion = Motion(t, np.zeros(1200, dtype=int), np.sin(t), np.cos(t), -np.sin(t))
    whole = replace(BESIDE, coulomb=BESIDE.coulomb + carried, static=BESIDE.static + carried)
    one = predict(motion, BESIDE, Hysteresis().contribute(motion, VALUES | more), np.zeros(1)).torque
    other = predict(motion, whole, Hysteresis(True).contribute(motion, PART | more), np.zeros(1)).torque
    np.testing.assert_allclose(one, other, atol=1e-12)


def test_two_elements_are_the_sum_of_each() -> None:
    t = np.linspace(0.0, 12.0, 1200)
    motion = Motion(t, np.zeros(1200, dtype=int), np.sin(t), np.cos(t), -np.sin(t))
    second = {"yield": TWO["yield_2"], "log_reach": TWO["log_reach_2"]}
    both, *each = (Hysteresis().contribute(motion, v).torque for v in (VALUES | TWO, VALUES, second))
    np.testing.assert_allclose(both, each[0] + each[1], atol=1e-15)
    assert Hysteresis().implausible(VALUES | TWO, {"coulomb": YIELD + 0.005}) is not None
    assert Hysteresis().implausible(VALUES, {"coulomb": YIELD + 0.005}) is None


def test_a_presliding_that_bends_smoothly_takes_two_elements(tmp_path: Path) -> None:
    """Dahl's solid friction (1968) beside the bristle: one element leaves some of it, which no effect is."""
    stiff = replace(BESIDE, bristle_stiffness=30.0)
    rng, frames, reach = np.random.default_rng(1), [], 0.12
    for trial in range(4):
        t = 0.005 * np.arange(3000)
        slow, fast = 2.0 * np.pi / (7.0 + trial), 2.0 * np.pi / (1.7 + 0.2 * trial)
        q = 0.6 * np.sin(slow * t) + 0.12 * np.sin(fast * t)
        w = 0.6 * slow * np.cos(slow * t) + 0.12 * fast * np.cos(fast * t)
        a = -0.6 * slow**2 * np.sin(slow * t) - 0.12 * fast**2 * np.sin(fast * t)
        motion, dahl = Motion(t, np.zeros(len(t), dtype=int), q, w, a), np.zeros(len(t))
        for k in range(1, len(t)):
            step = q[k] - q[k - 1]
            rest = np.sign(step) * 0.03
            dahl[k] = rest + (dahl[k - 1] - rest) * np.exp(-abs(step) / reach)
        torque = predict(motion, stiff, Contribution(torque=dahl + 0.01 * a), np.zeros(1)).torque
        torque = torque + 0.004 * rng.normal(size=len(t))
        frames.append(pd.DataFrame({"trial": trial, "time_s": t, "position_rad": q, "torque_nm": torque}))
    pd.concat(frames).to_csv(tmp_path / "log.csv", index=False)
    found = identify([Log.read(tmp_path / "log.csv")])
    assert [effect["name"] for effect in found.diagnosis["effects"]] == ["hysteresis", "inertia"]
    assert found.diagnosis["verdict"] == "effect_found"
    entry = found.parameters.effect("hysteresis")
    assert entry is not None
    carried = sum(entry.parameters[name].value for name in ("yield", "yield_2"))
    assert carried == pytest.approx(0.03, rel=0.15)
    assert found.parameters.static["coulomb"].value == pytest.approx(BESIDE.coulomb, rel=0.03)


def test_a_second_element_is_looked_for_beside_the_first() -> None:
    t = np.linspace(0.0, 12.0, 1200)
    motion = Motion(t, np.zeros(1200, dtype=int), np.sin(t), np.cos(t), -np.sin(t))
    (two,) = Hysteresis().larger(motion)
    assert two == Hysteresis(elements=2)
    assert two.larger(motion) == ()
    (halves,) = two.also_from({}, {"hysteresis.yield": 0.03, "hysteresis.log_reach": math.log(0.1)})
    assert halves["yield"] + halves["yield_2"] == pytest.approx(0.03)
    assert halves["log_reach"] < math.log(0.1) < halves["log_reach_2"]
    assert all(set(start) == {"log_reach_2"} for start in two.starts(motion))


def test_a_part_of_the_friction_is_looked_for_where_the_bristle_bends_too() -> None:
    """What presliding there is bends over a travel of the contact, not over a share of the stroke."""
    model = {"coulomb": 0.1, "bristle_stiffness": 50.0}
    scored, bend = Hysteresis(True).also_from({"log_reach": math.log(0.1)}, model)
    assert scored == {"yield": pytest.approx(0.04), "log_reach": math.log(0.1)}
    assert bend == {"yield": pytest.approx(0.04), "log_reach": pytest.approx(math.log(0.002))}
    assert Hysteresis(True).also_from({"log_reach": 0.0}, {"coulomb": 0.1}) == [
        {"yield": pytest.approx(0.04), "log_reach": 0.0}
    ]
    assert Hysteresis().also_from({"log_reach": 0.0}, model) == []


def test_a_file_says_which() -> None:
    for values in (VALUES, PART, VALUES | TWO, PART | TWO):
        parameters = Hysteresis().to_parameters(values)
        assert parameters.get("of_friction", 0.0) == values.get("of_friction", 0.0)
        assert Hysteresis().to_values(parameters) == pytest.approx(values)


MOTION = Motion(*np.zeros((5, 2)))


@pytest.mark.parametrize(("part", "beside"), [(0.03, True), (0.05, False)])
def test_what_is_small_beside_the_rest_is_an_element_of_its_own(part: float, beside: bool) -> None:
    model = {"coulomb": 0.1, "static": 0.15}
    found = Hysteresis(True).plainer(PART | {"yield": part}, model, MOTION)
    if beside:
        assert found is not None
        effect, others = found
        assert effect == Hysteresis()
        assert others == pytest.approx({"coulomb": 0.07, "static": 0.12})
    else:
        assert found is None
    assert Hysteresis().plainer(VALUES, model, MOTION) is None


@pytest.mark.parametrize(("carried", "said"), [(1.1, None), (1.3, "it would be more than the friction")])
def test_a_part_of_the_friction_is_not_much_more_than_it(carried: float, said: str | None) -> None:
    part = replace(Hysteresis(), of_friction=True)
    assert part.implausible({"yield": carried, "log_reach": 0.0}, {"coulomb": 1.0}) == said
