"""An effect that came in while others were missing gives way to what does better in its place."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from idtool.diagnosis.candidates import best_start, try_effect
from idtool.diagnosis.exchange import exchange
from idtool.diagnosis.selection import begun, completed
from idtool.effects import registry
from idtool.experiment.recipe import parse_recipe
from idtool.fit.joint import JointFit, refit
from idtool.fit.left_out import left_out_error
from idtool.fit.model import JointModel
from idtool.log import Log
from idtool.model.motion import Array
from idtool.parameters.axis import Axis
from idtool.rig import open_rig
from idtool.signals import record
from idtool.signals.thin import thin
from idtool.verbs.base_model import base_of_rows
from testbench.bench import SHORT_SESSION
from testbench.plants import recorded
from tests.diagnosis.conftest import swings


@cache
def axis(inside: str) -> JointFit:
    """An axis with an offset, more friction at one end, and waves that nothing explains; the fit has the
    friction and another effect."""
    rng = np.random.default_rng(0)

    def torque(t: Array, q: Array, w: Array) -> Array:
        friction = (0.06 + 0.03 * q) * np.tanh(w / 0.005) + 0.05 * w
        waves = 0.004 * np.sin(np.cumsum(rng.normal(size=len(t))))
        return friction + 0.02 + (waves + 0.001 * rng.normal(size=len(t)))

    recording = record([Log(swings(torque), Axis())])
    fit = base_of_rows(recording, "coulomb", "none").fits[0]
    for name in ("position_dependent_friction", inside):
        effect = registry.get(name)
        model = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
        nothing = {f"{name}.{c.name}": c.null for c in effect.active(model.recording.motion)}
        fit = refit(fit, model, nothing)
    return fit


LIBRARY = [registry.get(name) for name in ("torque_offset", "position_stiffness", "nonlinear_viscous")]


@pytest.mark.parametrize("inside", ["position_stiffness", "nonlinear_viscous", "torque_offset"])
def test_the_true_effect_takes_the_place_of_another(inside: str) -> None:
    """... of a wrong one, and of one that does as well with more numbers; of the true one nothing does."""
    fit = axis(inside)
    selection, said = begun(fit, LIBRARY), list[str]()
    found = exchange(selection, LIBRARY, said.append)
    assert (found is None) == (inside == "torque_offset")
    assert selection.candidates[inside].accepted
    if found:
        names = {effect.name for effect in found.fit.model.spec.effects}
        assert names == {"inertia", "position_dependent_friction", "torque_offset"}
        told = found.candidates[inside]
        assert not told.accepted
        assert told.why == "torque offset does better in its place"
        assert found.candidates["torque_offset"].accepted
        assert left_out_error(found.fit) < 1.01 * left_out_error(fit)


def test_what_leaves_noise_alone_is_not_put_in_question() -> None:
    fit = axis("position_stiffness")
    quiet = replace(fit, residual=fit.residual * fit.model.filtered_noise / fit.rmse)
    selection, said = begun(quiet, LIBRARY), list[str]()
    assert exchange(selection, LIBRARY, said.append) is None
    assert said == []


def test_one_lag_gives_way_to_the_two_that_it_stood_for() -> None:
    """A hobby servo with play whose motion is read late: a slip element takes a part of both."""
    runs = [parse_recipe(text, name) for name, text in SHORT_SESSION.items()]
    recording = thin(record(recorded(open_rig("sim:sts3215", seed=0), runs)))
    fit = base_of_rows(recording, "lugre", "auto").fits[0]
    element = registry.get("hysteresis")
    fit = completed(try_effect(fit, element, best_start(fit, element), far=True).fit)
    library = [effect for effect in registry.library() if effect.is_lag]
    selection = begun(fit, library)
    found = exchange(selection, library, lambda _: None)
    assert found is not None
    names = {effect.name for effect in found.fit.model.spec.effects}
    assert names == {"inertia", "backlash", "transport_delay"}
    assert found.candidates["hysteresis"].why == "others do better in its place"
    assert left_out_error(found.fit) < left_out_error(fit)
    assert [effect.name for effect in selection.fit.model.spec.effects] == ["inertia", "hysteresis"]
