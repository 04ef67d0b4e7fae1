"""A fit says by name how it ended, in its messages and in the parameter file."""

from __future__ import annotations

from functools import cache

import pytest

from benchmarks.sessions import log_of, truth
from idtool.effects import registry
from idtool.fit.findings import findings
from idtool.fit.identifiability import shortcomings
from idtool.fit.joint import JointFit, solve
from idtool.fit.model import JointModel
from idtool.fit.outcome import Outcome
from idtool.fit.spec import Spec
from idtool.signals import record
from idtool.verbs.identification import parameters_of


@cache
def fit(most: int, inertia: float = 0.0) -> JointFit:
    spec = Spec("lugre", None, ()).adding(registry.get("inertia"))
    model = JointModel.build(record([log_of("sine", 3, (2, 3))]), spec)
    return solve(model, model.coordinates({**truth(), "inertia.inertia": inertia}), most=most)


def test_a_fit_cut_short_says_so_with_advice() -> None:
    cut = fit(2)
    assert cut.outcome is Outcome.OUT_OF_EVALUATIONS
    told = {one.code: one for one in shortcomings(cut)}["out_of_evaluations"]
    assert "may be off" in told.why
    assert told.remedy == Outcome.OUT_OF_EVALUATIONS.advice != ""
    assert any(sentence.startswith("out of evaluations: ") for sentence in findings(cut, ("static",)))
    assert parameters_of(cut).provenance["fit"] == "out of evaluations"


def test_a_fit_that_converged_says_so_in_the_file_only() -> None:
    whole = fit(60)
    stuck = any(whole.at_bound.values())
    assert whole.outcome is (Outcome.AT_BOUND if stuck else Outcome.CONVERGED)
    assert not {one.code for one in shortcomings(whole)} & {"out_of_evaluations", "stalled"}
    assert parameters_of(whole).provenance["fit"] == whole.outcome.value


@pytest.mark.parametrize("outcome", list(Outcome))
def test_what_did_not_converge_has_advice(outcome: Outcome) -> None:
    assert outcome.meaning
    assert outcome.converged or outcome.advice
    assert len(outcome.notes) == (not outcome.converged)
