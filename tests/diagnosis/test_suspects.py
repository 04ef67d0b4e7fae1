"""An effect that hides in the friction curve: named as a suspect, and the intervals allow for it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.sessions import log_of, truth
from idtool.diagnosis.suspects import allowing_for, suspects
from idtool.effects import registry
from idtool.fit.joint import JointFit, solve
from idtool.fit.model import JointModel
from idtool.fit.spec import Spec
from idtool.signals import Recording, record


@cache
def recording() -> Recording:
    return record([log_of("sine", 3, (2, 3))])


def fitted(quadratic: float) -> JointFit:
    """A fit of the base model to an axis with so much c |w| w, N m s^2/rad^2, that nobody told it of."""
    plain = recording()
    w = plain.motion.velocity
    spoilt = replace(plain, torque=plain.torque + quadratic * np.abs(w) * w)
    model = JointModel.build(spoilt, Spec("lugre", None, (), soft=True).adding(registry.get("inertia")))
    return solve(model, model.coordinates({**truth(), "inertia.inertia": truth()["inertia"]}))


def test_nothing_is_suspected_of_an_axis_that_lacks_nothing() -> None:
    assert suspects(fitted(0.0)) == []


@pytest.mark.parametrize("quadratic", [0.06, -0.06])
def test_what_is_missing_is_among_the_suspects_and_is_allowed_for(quadratic: float) -> None:
    fit = fitted(quadratic)
    found = suspects(fit)
    assert "nonlinear_viscous" in [one.effect.name for one in found]
    assert [one.start.p_value for one in found] == sorted(one.start.p_value for one in found)
    allowed = allowing_for(fit, found)
    k = fit.model.names.index("viscous")
    off = abs(fit.values["viscous"] - truth()["viscous"])
    reach = [float(one.quantile[k] * np.sqrt(one.covariance[k, k])) for one in (fit, allowed)]
    assert off < reach[1]
    assert 1.5 * reach[0] < reach[1]
    assert np.all(np.diag(allowed.covariance) >= np.diag(fit.covariance))
