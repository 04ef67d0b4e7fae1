"""Second thoughts: what a special case does as well, what is next to nothing, what cannot be."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from idtool.diagnosis.plausible import impossible
from idtool.diagnosis.pruning import drop_what_may_be_unknown, simplify, veto
from idtool.diagnosis.selection import begun
from idtool.effects import registry
from idtool.fit.choose import with_load
from idtool.fit.joint import JointFit, refit
from idtool.fit.left_out import left_out_error
from idtool.fit.model import JointModel
from idtool.model.motion import Array
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from testbench.plants import TORQUE_CONSTANT, Plant, record_session

#: As `Case("several effects", 3150358905, ...)` of the study of the diagnosis draws it.
OFFSET = -0.0493553
PLANT = Plant(
    coulomb=0.0950117,
    static=0.1225938,
    stribeck_velocity=0.0961451,
    viscous=0.1294842,
    bristle_stiffness=0.1165377,
    bristle_damping=0.1720174,
    inertia=0.0044707,
    base=0.1709775,
    per_payload=0.5968637,
    effects={
        "position_dependent_friction": {
            "slope_1": -0.32919,
            "slope_2": -0.0136055,
            "center_rad": 0.0,
            "half_stroke_rad": 2.5,
        },
        "torque_offset": {"offset_nm": OFFSET},
    },
)


@pytest.fixture(scope="module")
def soft() -> JointFit:
    """A soft bristle, an offset and friction along the stroke; the offset is told as a spring."""
    recording = record(record_session(PLANT, "lab", 3150358905, temperature=False))
    starts = base_of_rows(recording, "lugre", "auto").fits
    loaded = JointModel.build(with_load(recording, starts[0]), starts[0].model.spec)
    fit, nothing = refit(starts[0], loaded), {"stiffness": 0.0, "pull": 0.0, "slope_1": 0.0, "slope_2": 0.0}
    for name in ("position_stiffness", "position_dependent_friction"):
        effect = registry.get(name)
        model = JointModel.build(fit.model.recording, fit.model.spec.adding(effect), fit.model.constants)
        fit = refit(
            fit, model, {f"{name}.{c.name}": nothing[c.name] for c in effect.active(model.recording.motion)}
        )
    return fit


def test_a_special_case_takes_its_place_beside_a_soft_bristle(soft: JointFit) -> None:
    """Without the spring the bristle makes up for it, far from where an offset is found."""
    library = registry.library()
    selection = begun(soft, library)
    for name in ("position_stiffness", "position_dependent_friction"):
        selection.candidates[name].accepted, selection.p_values[name] = True, 1e-9
    simplify(selection, library, lambda _: None)
    names = {effect.name for effect in selection.fit.model.spec.effects}
    assert names == {"position_dependent_friction", "torque_offset", "inertia"}
    assert selection.fit.values["torque_offset.offset"] == pytest.approx(OFFSET, abs=0.001)


def test_what_is_next_to_nothing_is_not_there(soft: JointFit) -> None:
    friction = registry.get("position_dependent_friction")
    assert impossible(soft, friction) is None
    at = [soft.model.names.index(f"{friction.name}.slope_{k}") for k in (1, 2)]
    x = soft.x.copy()
    x[at] = 0.002, -0.004
    assert impossible(replace(soft, x=x), friction) == "next to nothing of it is left"


def test_a_friction_per_load_below_zero_cannot_be(soft: JointFit) -> None:
    effect = registry.get("drive_backdrive")
    model = JointModel.build(soft.model.recording, soft.model.spec.adding(effect), soft.model.constants)
    fit = refit(soft, model, {"drive_backdrive.mu_drive": 0.0, "drive_backdrive.mu_backdrive": 0.0})
    at = [fit.model.names.index(f"drive_backdrive.{name}") for name in ("mu_drive", "mu_backdrive")]
    errors = np.sqrt(np.diag(fit.covariance))
    for sign, told in ((-0.5, None), (-20.0, "mu drive would be")):
        x = fit.x.copy()
        x[at] = sign * errors[at[0]], 0.05
        why = impossible(replace(fit, x=x), effect)
        assert why is None if told is None else told in str(why)


def test_a_torque_that_falls_with_more_current_cannot_be(soft: JointFit) -> None:
    effect, constant = registry.get("torque_constant_saturation"), 0.2 * TORQUE_CONSTANT
    recording = soft.model.recording
    recording = replace(recording, motion=replace(recording.motion, torque_constant=constant))
    with_it = JointModel.build(recording, soft.model.spec.adding(effect), soft.model.constants)
    fit = refit(soft, with_it, {"torque_constant_saturation.kappa": 0.0}, most=1)
    falls = 0.5 * constant / float(np.max(np.abs(recording.torque)))
    at = fit.model.names.index("torque_constant_saturation.kappa")
    for share, cannot in ((0.95, False), (1.05, True)):
        x = fit.x.copy()
        x[at] = share * falls
        assert (impossible(replace(fit, x=x), effect) == "more current would make less torque") == cannot


def test_other_rows_may_tell_a_special_case(soft: JointFit) -> None:
    """On the training rows a spring is sure, on all of them it is an offset."""
    library, recording = registry.library(), soft.model.recording
    pulled = replace(recording, torque=recording.torque + 0.05 * recording.motion.position)
    spring = refit(soft, JointModel.build(pulled, soft.model.spec, soft.model.constants))
    for other, changes in ((None, False), (soft, True)):
        selection = begun(spring, library)
        for name in ("position_stiffness", "position_dependent_friction"):
            selection.candidates[name].accepted, selection.p_values[name] = True, 1e-9
        assert simplify(selection, library, lambda _: None, other) == changes
        assert selection.candidates["torque_offset"].accepted == changes
        assert (selection.fit.model.recording is pulled) or not changes


def test_a_special_case_takes_the_place_of_what_adds_next_to_nothing(soft: JointFit) -> None:
    """... though rows enough make that a clear gain: a spring of half a per cent of the friction."""
    spring, offset = registry.get("position_stiffness"), registry.get("torque_offset")
    motion, friction = soft.model.recording.motion, soft.model.friction_sizes[0]
    for share, kept in ((0.005, False), (0.1, True)):
        pull = share * friction * motion.position / np.std(motion.position)
        recording = replace(soft.model.recording, torque=soft.predicted + pull)
        again = refit(soft, JointModel.build(recording, soft.model.spec, soft.model.constants))
        selection = begun(again, [offset, spring])
        selection.p_values[spring.name] = 1e-9
        simplify(selection, [offset, spring], lambda _: None)
        assert (spring in selection.fit.model.spec.effects) == kept


@pytest.mark.parametrize(
    ("without", "spread", "shown", "stays"),
    [
        (0.9, 0.0, 1.0, False),
        (0.9, 600.0, 1.0, True),
        (1.1, 0.0, 1.0, True),
        (1.0001, 0.0, 1.0, True),
        (0.5, 1.0, 1.0, False),
        (0.9, 0.0, 0.15, False),
        (0.9, 0.0, 0.05, True),
    ],
    ids=[
        "worse",
        "worse by chance",
        "better",
        "better, beside noise that the filter takes off",
        "surely worse",
        "worse where it shows somewhat",
        "worse where it hardly shows",
    ],
)
def test_held_out_rows_turn_down_what_they_contradict(
    soft: JointFit, without: float, spread: float, shown: float, stays: bool
) -> None:
    """An effect that the left-out trials surely need stays where the held-out rows cannot tell."""
    friction = registry.get("position_dependent_friction")
    scale = left_out_error(soft) ** 2
    chance = spread * np.resize([1.0, -1.0], 30)

    def held_out(fit: JointFit) -> Array:
        lacking = len(soft.model.spec.effects) - len(fit.model.spec.effects)
        return scale * 40.0 * (without**lacking + (chance if lacking else 0.0 * chance))

    def between(one: JointFit, other: JointFit) -> float:
        return shown * (left_out_error(other) ** 2 - left_out_error(one) ** 2)

    selection = begun(soft, [friction])
    gone = veto(selection, held_out, between, lambda _: None)
    assert (friction not in gone) == stays


def test_when_the_readings_were_taken_needs_no_prediction(
    soft: JointFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A delay within one sample is no effect that held-out rows could turn down, whatever they say."""
    friction = registry.get("position_dependent_friction")

    def held_out(fit: JointFit) -> Array:
        return np.full(30, 2.0 if friction in fit.model.spec.effects else 1.0)

    for why in (None, "that is when they were read"):
        monkeypatch.setattr(type(friction), "of_the_readings", lambda *_, why=why: why)
        gone = veto(begun(soft, [friction]), held_out, lambda *_: 1.0, lambda _: None)
        assert (friction in gone) == (why is None)


@cache
def told_a_spring(true: bool) -> JointFit:
    """A fit with a spring, beside a drift in time that goes as the position does, as far as it can."""
    axis = Plant(0.080, 0.115, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)
    spring = {"position_stiffness": {"stiffness_nm_per_rad": 0.05, "neutral_rad": 0.0}}
    (log,) = record_session(replace(axis, effects=spring if true else {}), "lab", 3, ("sweep",))
    q = log.frame["position_rad"].to_numpy()
    bends = np.cos(np.pi * np.outer(np.linspace(0.0, 1.0, len(q)), np.arange(1, 6)))
    drift = 0.2 * bends @ np.linalg.lstsq(bends, q)[0]
    log = replace(log, rows=log.frame.assign(current_a=log.frame["current_a"] + drift / TORQUE_CONSTANT))
    starts = base_of_rows(record([log]), "lugre", "auto").fits
    spec = starts[0].model.spec.adding(registry.get("position_stiffness"))
    model = JointModel.build(starts[0].model.recording, spec, starts[0].model.constants)
    return refit(starts[0], model, {"position_stiffness.stiffness": 0.0, "position_stiffness.pull": 0.0})


@pytest.mark.parametrize(
    ("follows", "true", "kept"),
    [("time", False, False), ("time", True, True), ("position", False, True), ("", False, True)],
)
def test_what_something_unknown_may_be_all_of(follows: str, true: bool, kept: bool) -> None:
    selection = begun(told_a_spring(true), registry.library())
    dropped = drop_what_may_be_unknown(selection, selection.fit, (follows,) if follows else ())
    assert [effect.name for effect in dropped] == ([] if kept else ["position_stiffness"])
    assert ("position_stiffness.stiffness" in selection.fit.model.names) == kept
