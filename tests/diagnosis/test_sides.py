"""Gravity beside friction under load, of which sliding does not tell whether it is alike both ways."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from idtool import Log
from idtool.diagnosis.candidates import best_start, try_effect
from idtool.diagnosis.sides import allowing_for_sides
from idtool.effects import registry
from idtool.fit.choose import with_load
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.fit.results import gravity_parameters
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from tests.diagnosis.conftest import swings

DRIVE, BACKDRIVE, PER_PAYLOAD = 0.08, 0.02, 0.5


@pytest.fixture
def lifting(tmp_path: Path) -> JointFit:
    """Payloads that are raised and lowered, dry friction that is larger while they are raised."""
    frame = swings(lambda t, q, w: 0.05 * np.sign(w) + 0.02 * w)
    frame["payload_kg"] = 0.2 + 0.3 * (frame["trial"] % 3)
    speed = np.tile(np.sin(2.0 * np.pi * 0.01 * np.arange(800) / 4.0), 6)
    weight = PER_PAYLOAD * frame["payload_kg"]
    friction = np.where(speed > 0.0, DRIVE, -BACKDRIVE) * weight * (speed != 0.0)
    frame["torque_nm"] += weight + friction + 0.001 * np.random.default_rng(0).normal(size=len(frame))
    frame.to_csv(tmp_path / "log.csv", index=False)
    recording = record([Log.read(tmp_path / "log.csv")])
    fit = base_of_rows(recording, "coulomb", "slide").fits[0]
    return refit(fit, JointModel.build(with_load(recording, fit), fit.model.spec, fit.model.constants))


def test_the_interval_of_gravity_holds_it_and_a_sentence_says_why(lifting: JointFit) -> None:
    """It was 3 % off, a hundred standard errors."""
    effect = registry.get("load_dependent_friction")
    fit = try_effect(lifting, effect, best_start(lifting, effect)).fit
    assert fit.values["load_dependent_friction.mu"] == pytest.approx(0.5 * (DRIVE + BACKDRIVE), rel=0.1)
    before, after = (gravity_parameters(one)["per_payload"] for one in (fit, allowing_for_sides(fit)[0]))
    assert before.ci95 is not None
    assert before.ci95[0] > 1.01 * PER_PAYLOAD
    assert after.ci95 is not None
    low, high = after.ci95
    assert low < PER_PAYLOAD < high
    assert high - low == pytest.approx(2.0 * 0.05 * before.value, rel=0.2)
    assert "up to 4.8 % another" in str(allowing_for_sides(fit)[1])


def test_without_friction_under_load_there_is_nothing_to_allow_for(lifting: JointFit) -> None:
    assert allowing_for_sides(lifting) == (lifting, None)
