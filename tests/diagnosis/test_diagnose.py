"""Which of several base models the diagnosis goes on from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from idtool.diagnosis import diagnose as diagnosing
from idtool.diagnosis import selection as selecting
from idtool.diagnosis.diagnose import diagnose
from idtool.diagnosis.residual import ResidualTest
from idtool.diagnosis.selection import begun, extend
from idtool.diagnosis.split import split
from idtool.diagnosis.state import Rival, Selection
from idtool.effects import registry
from idtool.fit.choose import choose_gravity, first_fit
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.fit.shortcoming import Shortcoming
from idtool.fit.spec import Spec
from idtool.model.motion import Array
from idtool.signals import Recording, record
from idtool.signals.thin import thin
from idtool.verbs.identify import identify
from testbench.diagnosis_cases import cases
from testbench.diagnosis_cases import record as recorded
from testbench.plants import Plant, record_session

PAPER = Plant(0.070, 0.030, 0.090, 0.155, 0.051, 0.297, 0.006, 0.2295, 0.4457)


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A soft bristle, as the paper's."""
    return record(record_session(PAPER, "lab", 3, ("gravity", "sine")))


def test_a_result_is_not_taken_while_another_base_model_predicts_better(recording: Recording) -> None:
    few = thin(recording)
    spec = Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),))
    stiff, soft = (first_fit(few, replace(spec, soft=how)) for how in (False, True))
    assert stiff.rmse > 1.5 * soft.rmse
    # the one effect that may stand for the soft bristle leaves nothing that follows anything
    found = diagnose(recording, [stiff, soft], [registry.get("compliance")], given=True)
    assert found.start == 1
    assert found.verdict == "adequate"
    assert np.isclose(found.final.values["coulomb"], 0.070, rtol=0.05)


def test_a_base_model_is_given_up_once_it_needs_more_and_predicts_worse(recording: Recording) -> None:
    recording = thin(recording)
    spec = Spec("lugre", *choose_gravity(recording, "auto"), (registry.get("inertia"),))
    stiff, soft = (first_fit(recording, replace(spec, soft=how)) for how in (False, True))
    for rival in (soft, None):
        selection, said = begun(stiff, []), list[str]()
        extend(selection, [], said.append, rival=rival and Rival(rival))
        assert selection.hopeless == (rival is not None)
        assert said[-1].startswith("accepted") == (rival is not None)
    # one that predicts no better is no reason
    selection = begun(soft, [])
    extend(selection, [], rival=Rival(stiff))
    assert not selection.hopeless


def test_a_search_that_stalls_behind_a_rival_is_given_up(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    """... before all that is tried where nothing passes."""
    few = thin(recording)
    spec = Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),))
    stiff, soft = (first_fit(few, replace(spec, soft=how)) for how in (False, True))
    for rival, given_up in ((soft, True), (stiff, False), (None, False)):
        tried: list[str] = []
        for last in ("_searched_anew", "_on_another_curve", "_two_at_once"):
            monkeypatch.setattr(selecting, last, lambda *_, last=last, tried=tried: tried.append(last))
        selection = begun(stiff, [])
        extend(selection, [], rival=rival and Rival(rival), given=True)
        assert selection.hopeless == given_up
        assert (tried == []) == given_up


def test_what_two_base_models_come_to_is_gone_on_with_once(recording: Recording) -> None:
    few = thin(recording)
    spec = Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),), soft=True)
    first = begun(first_fit(few, spec), [])
    first.step()
    assert not first.hopeless
    # at the same minimum, at a worse one, at a better one, and with another effect
    asymmetry = registry.get("direction_asymmetry")
    larger = JointModel.build(few, spec.adding(asymmetry))
    for here, other, hopeless in (
        (first.fit, first.fit, True),
        (replace(first.fit, residual=1.01 * first.fit.residual), first.fit, True),
        (first.fit, replace(first.fit, residual=1.01 * first.fit.residual), False),
        (refit(first.fit, larger, {"direction_asymmetry.asymmetry": 0.0}), first.fit, False),
    ):
        second = begun(here, [asymmetry])
        second.others = (other,)
        second.step()
        assert second.hopeless == hopeless


def test_a_simpler_law_is_not_taken_where_it_predicts_worse(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    few = thin(recording)
    spec = Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),), soft=True)

    def coulomb(fit: JointFit) -> tuple[JointFit, list[str], list[Shortcoming]]:
        plain = JointModel.build(fit.model.recording, replace(fit.model.spec, friction="coulomb"))
        return refit(fit, plain), ["Coulomb friction is used."], []

    monkeypatch.setattr(diagnosing, "step_down", coulomb)
    found = diagnose(recording, [first_fit(few, spec)], [])
    assert found.final.model.spec.friction == "lugre"
    assert "Coulomb friction is used." not in found.notes


@pytest.mark.parametrize("quadratic", [0.04, 0.0])
def test_what_was_turned_down_though_it_is_no_chance_is_allowed_for(
    quadratic: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the held-out rows deny an effect the numbers are of a model without it, which may be off."""
    plain = record(record_session(replace(PAPER, bristle_stiffness=20.0), "lab", 3, ("gravity", "sine")))
    w = plain.motion.velocity
    spoilt = replace(plain, torque=plain.torque + quadratic * np.abs(w) * w)
    effect = registry.get("nonlinear_viscous")

    def squares(fit: JointFit, parts: object, beside: object = None) -> Array:
        return np.full(30, 4.0 if effect in fit.model.spec.effects else 1.0)

    monkeypatch.setattr(diagnosing, "held_out_squares", squares)
    few = thin(spoilt)
    spec = Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),))
    found = diagnose(spoilt, [first_fit(few, spec)], [effect])
    assert found.effects == ()
    told = [note for note in found.notes if "but turned down: nonlinear_viscous (held-out" in note]
    assert bool(told) == bool(quadratic)
    assert ("nonlinear_viscous" in found.to_document()["hidden"]) == bool(quadratic)
    final = found.final
    k = final.model.names.index("viscous")
    off = abs(final.values["viscous"] - PAPER.viscous)
    bare = replace(final, pull=None)
    reach, without = (float(one.quantile[k] * np.sqrt(one.covariance[k, k])) for one in (final, bare))
    assert off < reach
    assert (off > without) == bool(quadratic)
    assert (reach > without) == bool(quadratic)


@pytest.mark.parametrize(
    ("numbers", "error", "depends", "named"),
    [
        (9, 0.99, True, True),
        (5, 1.19, False, True),
        (5, 1.19, True, False),
        (5, 1.21, False, False),
        (9, 1.01, False, False),
    ],
    ids=["as good", "fewer numbers", "something is left", "surely worse", "more numbers"],
)
def test_names_come_before_shapes_that_have_none(
    numbers: int, error: float, depends: bool, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bumps follow much: names are believed where they leave nothing, and bumps are not surely better."""

    class OfSize:
        def __init__(self, numbers: int, error: float) -> None:
            self.x, self.error = np.zeros(numbers), error

    left = ResidualTest("position", 0.5, 1e-9 if depends else 0.5)
    monkeypatch.setattr(diagnosing, "left_out_error", lambda fit: fit.error)
    monkeypatch.setattr(diagnosing, "test_residual", lambda fit, which: [left])
    assert diagnosing._as_good(OfSize(numbers, error), OfSize(8, 1.0)) == named


@pytest.mark.parametrize("early", [False, True], ids=["what it found", "what comes in one by one"])
@pytest.mark.parametrize(("anew", "taken"), [(1.19, True), (1.21, False)])
def test_a_search_begins_anew_where_rows_count_otherwise_beside_what_it_found(
    recording: Recording, anew: float, taken: bool, early: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """... and that is taken, unless it comes to something that is surely worse. The effects that come in one
    by one may tell it before the search has ended."""
    few = thin(recording)
    fit = first_fit(few, Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),)))
    once, again = (diagnosing._Found(place, fit, begun(replace(fit), []), {}) for place in (0, 1))
    results, first, gone_on = [again] if early else [once, again], list[Selection](), list[object]()
    weighed = [False, True, False] if early else [False, False, True]
    search = diagnosing._Search(split(recording), [], lambda _: None, False, 0.0)
    monkeypatch.setattr(diagnosing, "one_by_one", lambda selection, *_, **options: first.append(selection))
    monkeypatch.setattr(search, "_best_of", lambda bases: results.pop(0))
    monkeypatch.setattr(search, "_weighed", lambda fit: weighed.pop(0))
    monkeypatch.setattr(search, "_select", lambda chosen: (gone_on.append(chosen), ({}, fit))[1])
    monkeypatch.setattr(diagnosing, "exchange", lambda *_: None)
    errors = {id(again.selection.fit): anew}
    monkeypatch.setattr(diagnosing, "left_out_error", lambda fit: errors.get(id(fit), 1.0))
    found, before = search.found([fit]), first[0] if early else once.selection
    assert found is again if taken else found.selection is before
    assert (found is once) == (not taken and not early)
    assert gone_on == ([] if taken else [before])
    assert (results, weighed) == ([], [])


@pytest.mark.parametrize("better", [True, False])
def test_another_effect_stays_where_it_leads_to_something_better(
    recording: Recording, better: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """... and where what came in goes again, nothing has happened."""
    few = thin(recording)
    fit = first_fit(few, Spec("lugre", *choose_gravity(few, "auto"), (registry.get("inertia"),)))
    library = [registry.get("position_ripple")]
    once, tried = diagnosing._Found(0, fit, begun(fit, library), {}), list[object]()
    search = diagnosing._Search(split(recording), library, lambda _: None, False, 0.0)

    def exchange(selection: Selection, *_: object) -> Selection | None:
        tried.append(other := selection.copy())
        other.candidates["position_ripple"].accepted = True
        other.fit = replace(other.fit, residual=(0.9 if better else 1.0) * other.fit.residual)
        return other if len(tried) == 1 else None

    monkeypatch.setattr(search, "_best_of", lambda bases: once)
    monkeypatch.setattr(search, "_weighed", lambda fit: False)
    monkeypatch.setattr(search, "_select", lambda selection: ({}, fit))
    monkeypatch.setattr(diagnosing, "exchange", exchange)
    found = search.found([fit])
    assert (found.selection is tried[0]) == better
    assert found.selection.candidates["position_ripple"].accepted == better


@pytest.mark.long
def test_a_law_that_predicts_worse_is_not_stepped_down_to() -> None:
    """Friction that is higher at one speed, which no effect is: beside what stands for it the bristle bends
    over more than the travel. The static curve in its place left half as much again on held-out trials."""
    (case,) = (
        c for c in cases(("ours",), 0, 0, 0, 2, 0) if c.what == ("bump at one speed",) and c.sensors != "lab"
    )
    found = identify(recorded(case).logs).diagnosis
    assert found["verdict"] == "unexplained"
    assert found["friction"] == "lugre"
    assert found["error"]["held_out"]["after"] <= found["error"]["held_out"]["before"]
    assert any("friction at one speed" in note for note in found["notes"])
