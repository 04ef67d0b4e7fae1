"""Friction levels that the rows contradict, or do not tell from viscous friction, are not determined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log
from idtool.effects import registry
from idtool.fit.choose import first_fit
from idtool.fit.identifiability import shortcomings, undetermined
from idtool.fit.joint import JointFit
from idtool.fit.levels import contradicted_at_rest, held_at_rest, rising
from idtool.fit.spec import Spec
from idtool.signals import record

COULOMB, HELD = 0.1, 0.07


def fit_of(*, rests: float = 3.0) -> JointFit:
    """Swings with rests between them in which the drive pushes with `HELD`."""
    rng, rows = np.random.default_rng(0), []
    t, q = 0.0, 0.0
    for speed in (0.1, -0.1, 0.3, -0.3, 0.8, -0.8):
        for moving, seconds in ((False, rests), (True, 4.0)):
            k = np.arange(round(seconds / 0.005))
            w = speed * np.sin(np.pi * k / len(k)) ** 2 if moving else np.zeros(len(k))
            where = q + 0.005 * np.cumsum(w)
            level = COULOMB * (1.0 + 0.2 * np.exp(-((w / 0.05) ** 2)))
            torque = level * np.sign(w) + 0.05 * w if moving else np.full(len(k), HELD)
            rows.append(np.column_stack([t + 0.005 * (k + 1), where, torque]))
            t, q = t + 0.005 * len(k), q + 0.005 * float(w.sum())
    table = np.concatenate(rows)
    frame = pd.DataFrame(table, columns=["time_s", "position_rad", "torque_nm"]).assign(trial=0)
    frame["torque_nm"] += 0.002 * rng.standard_normal(len(frame))
    return first_fit(record([Log(frame, Axis())]), Spec("stribeck", None, (), (registry.get("inertia"),)))


def with_friction(fit: JointFit, **values: float) -> JointFit:
    return replace(fit, x=fit.model.coordinates(fit.values | values))


def test_what_a_rest_holds_is_at_most_the_stiction() -> None:
    fit = fit_of()
    assert held_at_rest(fit) == pytest.approx(HELD, abs=0.003)
    assert contradicted_at_rest(fit) is None
    fades = with_friction(fit, static=0.5 * HELD)
    found = contradicted_at_rest(fades)
    assert found is not None
    assert (
        "half of its rests hold 0.07 N m or more, above the stiction that was found (0.035)" in found.sentence
    )
    assert undetermined(fades)["static.static"][0] == pytest.approx(HELD, abs=0.003)
    assert "static.stribeck_velocity" in undetermined(fades)
    assert contradicted_at_rest(with_friction(fit_of(rests=0.0), static=0.5 * HELD)) is None


def test_a_level_that_friction_rises_to_all_along_is_not_told_from_viscous_friction() -> None:
    fit = fit_of()
    assert rising(fit) is None
    wide = with_friction(fit, static=0.5 * COULOMB, stribeck_velocity=0.5)
    found = rising(wide)
    assert found is not None
    assert "friction rises over all speeds up to 0.8 rad/s" in found.sentence
    assert found.code in {one.code for one in shortcomings(wide)}
    assert {"static.coulomb", "static.stribeck_velocity", "static.viscous"} <= set(undetermined(wide))
    assert rising(with_friction(wide, static=2.0 * COULOMB)) is None
    assert rising(with_friction(wide, stribeck_velocity=0.2)) is None
