"""A fit of one part knows when its model is wrong, and its intervals allow for that."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from idtool.diagnosis.evidence import Background
from idtool.diagnosis.remainder import Remainder, doubted, memory_of_noise, remainder
from idtool.diagnosis.residual import DEPENDS, test_residual
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.fit.staged import StaticFit, fit_static
from idtool.parameters import Axis, Parameters
from idtool.signals import record
from idtool.verbs.identify import identify
from testbench.plants import TORQUE_CONSTANT, Plant, record_session

CLEAN = Plant(0.080, 0.115, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)
LACKING = {
    "ripple": {
        "position_ripple": {
            "cycles_per_turn": 24.0,
            "amplitude_1_nm": 0.012,
            "phase_1_rad": 0.7,
            "amplitude_2_nm": 0.003,
            "phase_2_rad": -1.1,
        }
    },
    "spring": {"position_stiffness": {"stiffness_nm_per_rad": 0.03, "neutral_rad": 0.4}},
    "asymmetry": {"direction_asymmetry": {"asymmetry_nm_s_per_rad": 0.03}},
}


@cache
def static(lacking: str = "", seed: int = 0) -> StaticFit:
    """The fit of a sweep of an axis, clean or with one of LACKING."""
    plant = replace(CLEAN, effects=LACKING[lacking]) if lacking else CLEAN
    logs = record_session(plant, "lab", seed, ("sweep",))
    return fit_static(record(logs), Parameters(axis=Axis("rotary", TORQUE_CONSTANT)))


def test_of_what_follows_nothing_large_small_parts_are_not_denied() -> None:
    """It was told to follow nothing at all beside a list of what it depends on."""
    assert Remainder(0.4, ("time",)).note.startswith("the residual still depends on time; ")
    assert "no part of it that matters follows" in Remainder(0.7, ()).note


def test_what_was_not_looked_for_is_not_denied() -> None:
    """The textbook model has its effects, and no others are tried."""
    assert Remainder(0.4, ("time",)).note.endswith("no effect of the library accounts for it.")
    logs = record_session(replace(CLEAN, effects=LACKING["ripple"]), "lab", 0, ("sweep",))
    note = identify(logs, friction="coulomb").diagnosis["unexplained"]["note"]
    assert note.endswith("no effect was looked for.")


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_silent_and_without_a_doubt_where_nothing_is_lacking(seed: int) -> None:
    fit = static(seed=seed).fit
    assert remainder(fit) is None
    assert doubted(fit, None) is fit


def test_the_chance_of_small_shares_is_not_computed_and_changes_no_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It takes most of the time of these tests."""
    fit = static("ripple", 5).fit
    chances: list[int] = []
    chance = Background.chance
    monkeypatch.setattr(Background, "chance", lambda *given: chances.append(1) or chance(*given))
    all_of_them = test_residual(fit, 0.0)
    whole = len(chances)
    large = test_residual(fit, DEPENDS)
    assert 0 < len(chances) - whole < whole
    for one, other in zip(all_of_them, large, strict=True):
        assert (one.variable, one.share) == (other.variable, other.share)
        assert (one.depends, one.may_depend) == (other.depends, other.may_depend)
    assert any(test.depends for test in large)


@pytest.mark.parametrize(
    "lacking", ["ripple", *(pytest.param(one, marks=pytest.mark.long) for one in ("spring", "asymmetry"))]
)
def test_says_so_and_widens_where_an_effect_is_lacking(lacking: str) -> None:
    fit = static(lacking, 5).fit
    left = remainder(fit)
    assert left is not None
    assert left.depends_on
    wide = doubted(fit, left)
    np.testing.assert_array_equal(wide.x, fit.x)
    names = fit.model.names
    for name in ("coulomb", "viscous"):
        place = names.index(name)
        truth = getattr(CLEAN, name) if name == "viscous" else np.log(CLEAN.coulomb)
        before, after = (np.sqrt(one.covariance[place, place]) for one in (fit, wide))
        assert after >= before
        assert abs(fit.x[place] - truth) < wide.quantile[place] * after


def left_with(torque: np.ndarray, share: float) -> tuple[JointFit, Remainder | None]:
    """A clean fit to whose residual a torque is added, `share` of the friction after the filter."""
    fit = static().fit
    recording = fit.model.recording
    torque = torque * share * fit.model.friction_sizes[0] / np.std(recording.filtered(torque))
    shaken = replace(recording, torque=fit.predicted + torque)
    other = refit(fit, JointModel.build(shaken, fit.model.spec, fit.model.constants))
    return other, remainder(other)


def test_a_shape_that_was_found_is_what_is_left_follows() -> None:
    """A bump at one place is in too few rows for a test of all: what was said to look like one follows the
    position."""
    fit, left = left_with(coloured(1.0), 0.1)
    assert left is not None
    assert left.depends_on == ()
    told = remainder(fit, unnamed=["position"])
    assert told is not None
    assert told.depends_on == ("position",)
    assert "depends on position" in told.note


def coloured(memory_s: float) -> np.ndarray:
    """Normal noise that forgets within that time, per row."""
    time = static().fit.model.recording.motion.time
    keeps = np.exp(-float(np.median(np.diff(time))) / memory_s)
    return np.asarray(lfilter([1.0], [1.0, -keeps], np.random.default_rng(0).normal(size=len(time))))


@pytest.mark.parametrize(("share", "above"), [(0.15, 0.8), (0.06, 0.6), (0.03, None)])
def test_what_comes_and_goes_is_told_though_it_repeats_nothing(share: float, above: float | None) -> None:
    """A torque that turns round from row to row has no memory, and no floor of the sensors explains it."""
    rng, rows = np.random.default_rng(0), len(static().fit.model.recording.torque)
    bursts = np.repeat(rng.random(rows // 40 + 1) < 0.1, 40)[:rows]
    _, left = left_with(np.diff(rng.normal(size=rows), prepend=0.0) * bursts, share)
    assert (left is not None) == (above is not None)
    if left is not None:
        assert left.depends_on == ()
        assert above is not None
        assert left.share > above


def test_noise_of_filtered_readings_is_noise() -> None:
    """As large throughout, with a short memory: the steps from row to row do not show all of it."""
    fit, left = left_with(coloured(0.03), 0.06)
    assert left is None
    memory = memory_of_noise(fit)
    assert memory is not None
    assert memory == pytest.approx(0.03, abs=0.015)
    assert memory_of_noise(static().fit) is None


def test_noise_has_the_steps_of_its_memory() -> None:
    """What is larger than a filter can have hidden of the steps from row to row is no noise of readings."""
    fit, left = left_with(coloured(0.03), 0.12)
    assert memory_of_noise(fit) is None
    assert left is not None


def test_what_lasts_is_told_though_it_is_as_large_throughout() -> None:
    fit, left = left_with(coloured(1.0), 0.1)
    assert memory_of_noise(fit) is None
    assert left is not None
