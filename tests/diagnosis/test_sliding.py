"""What a model is better by where the axis slides, and what only after turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.diagnosis import sliding
from idtool.diagnosis.passing import why_not
from idtool.diagnosis.selection import begun
from idtool.diagnosis.shapes import UNNAMED
from idtool.diagnosis.sliding import doubtful, of_presliding
from idtool.diagnosis.state import Trial
from idtool.effects import registry
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.model.motion import since_reversal


def test_what_shows_after_turns_alone_is_of_the_presliding(slipping: JointFit) -> None:
    """Any shape may follow what LuGre's bristle leaves there; an effect that a turn calls up has its due."""
    motion, row = slipping.model.recording.motion, slipping.model.recording.row
    travel = since_reversal(motion.position, motion.velocity, motion.trial)[row]
    settled = travel > 8.0 * slipping.presliding_scale
    assert 0.2 < settled.mean() < 0.95
    before = replace(slipping, residual=np.ones(len(row)))
    # all of what goes is from rows that slide, from the others, and from all alike
    for gone, of_turns in ((settled, False), (~settled, True), (np.ones(len(row), dtype=bool), False)):
        after = replace(slipping, residual=np.where(gone, 0.5, 1.0))
        for name in ("nonlinear_viscous", "position_ripple", "torque_offset"):
            assert of_presliding(before, after, registry.get(name)) == of_turns
        for exempt in (registry.get("backlash"), registry.get("breakaway_dwell"), UNNAMED[0]):
            assert not of_presliding(before, after, exempt)


@pytest.mark.parametrize(
    ("error", "where_it_slides", "in_doubt"), [(0.8, True, False), (0.8, False, True), (0.9, True, True)]
)
def test_a_curve_that_rises_all_along_has_to_be_surely_better_where_the_axis_slides(
    slipping: JointFit, error: float, where_it_slides: bool, in_doubt: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion, row = slipping.model.recording.motion, slipping.model.recording.row
    travel = since_reversal(motion.position, motion.velocity, motion.trial)[row]
    wide = {"coulomb": 0.045, "static": 0.02, "stribeck_velocity": 0.5 * slipping.model.scales.speed}
    bent = slipping.model.coordinates(slipping.values | wide)
    falls = slipping.model.coordinates(slipping.values | wide | {"static": 0.05})
    plain = replace(slipping, x=falls, residual=np.ones(len(row)))
    better = (travel > 8.0 * plain.presliding_scale) == where_it_slides
    rising = replace(slipping, x=bent, residual=np.where(better, 0.5, 1.0))
    monkeypatch.setattr(sliding, "left_out_error", lambda fit: error if fit is rising else 1.0)
    assert doubtful(rising, plain) == in_doubt
    # a curve that falls, and one beside which another rises as well, are judged by their errors
    assert not doubtful(replace(plain, residual=rising.residual), plain)
    assert not doubtful(rising, replace(plain, x=bent))


@pytest.mark.parametrize(("error", "comes_in"), [(0.9, False), (0.8, True)])
def test_no_effect_comes_in_with_a_curve_that_rises_all_along(
    slipping: JointFit, error: float, comes_in: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """... where the curve did not before: it would stand for viscous friction, unless left-out trials surely
    ask for it."""
    effect = registry.get("nonlinear_viscous")
    model = JointModel.build(
        slipping.model.recording, slipping.model.spec.adding(effect), slipping.model.constants
    )
    fit = refit(slipping, model, {"nonlinear_viscous.quadratic": 0.2})
    wide = {"coulomb": 0.045, "static": 0.02, "stribeck_velocity": 0.5 * model.scales.speed}
    bent = replace(slipping, x=slipping.model.coordinates(slipping.values | wide))
    rising = replace(fit, x=model.coordinates(fit.values | wide | {"nonlinear_viscous.quadratic": 0.05}))
    monkeypatch.setattr(
        sliding, "left_out_error", lambda one: error if effect in one.model.spec.effects else 1.0
    )
    stands = sliding.stands_for_viscous_friction
    assert stands(slipping, rising) == (not comes_in)
    assert not stands(slipping, fit)
    assert not stands(bent, rising)
    why = why_not(begun(slipping, [effect]), Trial(effect, rising, 0.0), 1.0, error)
    assert ("rise all along" in str(why)) == (not comes_in)
    # a narrower one that leaves less than half of the viscous friction stands for it too
    for narrow, share, taken in ((0.2, 0.4, True), (0.2, 0.6, False), (1.0, 0.4, True)):
        own = {"coulomb": 0.045, "stribeck_velocity": narrow * model.scales.speed}
        values = fit.values | own | {"static": 0.02, "viscous": share * slipping.values["viscous"]}
        assert stands(slipping, replace(fit, x=model.coordinates(values))) == (taken and not comes_in)
        assert not stands(slipping, replace(fit, x=model.coordinates(values | {"static": 0.05})))
