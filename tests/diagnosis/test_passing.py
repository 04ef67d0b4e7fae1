"""What an effect adds to its special case is asked apart."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from idtool.diagnosis import selection as selecting
from idtool.diagnosis.candidates import best_start, chance_beside, try_effect
from idtool.diagnosis.evidence import chance_of
from idtool.diagnosis.plausible import CHANCE
from idtool.diagnosis.pruning import simplify
from idtool.diagnosis.selection import begun, passing
from idtool.effects import registry
from idtool.fit.joint import JointFit
from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from tests.diagnosis.conftest import swings

OFFSET, SPRING = (registry.get(name) for name in ("torque_offset", "position_stiffness"))


@cache
def base(spring: float, seed: int = 0) -> JointFit:
    """The base fit of an axis with an offset, a spring (N m/rad) and something slow that nothing explains."""
    rng = np.random.default_rng(seed)

    def torque(t: Array, q: Array, w: Array) -> Array:
        slow = 0.01 * np.interp(t, np.linspace(0.0, 8.0, 9), rng.normal(size=9))
        known = 0.06 * np.tanh(w / 0.005) + 0.05 * w + 0.03 + spring * q
        return known + slow + 0.001 * rng.normal(size=len(t))

    recording = record([Log(swings(torque), Axis())])
    fit = base_of_rows(recording, "coulomb", "none").fits[0]
    return fit


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("spring", [0.0, 0.1])
def test_a_spring_has_to_be_surer_than_its_offset(spring: float, seed: int) -> None:
    """That the offset is sure makes the spring sure, which has it; what it adds is asked beside it."""
    fit = base(spring, seed)
    trial = try_effect(fit, SPRING, best_start(fit, SPRING))
    assert chance_of(trial.fit, SPRING) < CHANCE
    selection = begun(fit, [OFFSET, SPRING])
    passed = passing(selection, trial)
    assert bool(passed) == (spring > 0.0)
    told = selection.candidates[SPRING.name].why
    assert ("what it adds to torque offset may be chance" in told) == (spring == 0.0)
    # one that came in before what it adds could be told goes
    selection.fit = trial.fit
    selection.p_values[SPRING.name] = trial.p_value
    simplify(selection, [OFFSET, SPRING], lambda _: None)
    assert (SPRING.name in {e.name for e in selection.fit.model.spec.effects}) == (spring > 0.0)


def test_the_chance_of_what_is_added_is_one() -> None:
    """Over many axes without a spring it is spread evenly, though what is left is slow."""
    found = []
    for seed in range(40):
        fit = base(0.0, seed)
        trial = try_effect(fit, SPRING, best_start(fit, SPRING))
        found.append(chance_beside(trial.fit, SPRING, OFFSET, fit))
    assert np.mean(np.array(found) < 0.05) <= 0.1
    assert 0.3 < np.mean(np.array(found) < 0.5) < 0.7


def test_a_special_case_is_tried_beside_what_leaves_less(monkeypatch: pytest.MonkeyPatch) -> None:
    """... however far behind its own score is: what the larger one adds may turn out to be chance."""
    monkeypatch.setattr(selecting, "_REFITTED", 1)
    tried = list[str]()
    winner = selecting.next_effect(begun(base(0.0), [OFFSET, SPRING]), [OFFSET, SPRING], tried.append)
    assert winner is not None
    assert winner.effect is OFFSET
    assert [words.split(" (")[0] for words in tried][:1] == ["trying position stiffness"]
