"""What hides an effect from the scores, and how it is found all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import gaussian_filter1d

from idtool import Log, identify
from idtool.diagnosis import diagnose as diagnosis
from idtool.diagnosis import selection
from idtool.diagnosis.candidates import Start, best_start, try_effect
from idtool.diagnosis.diagnose import diagnose
from idtool.diagnosis.state import Candidate, Selection, Trial
from idtool.effects import registry
from idtool.effects.base import Coordinate, Effect, Values
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.model.contribution import Contribution
from idtool.model.motion import Array, Motion
from idtool.signals import Recording, record
from idtool.verbs.base_model import base_of_rows
from testbench.plants import SESSION, Plant, record_session
from tests.diagnosis.conftest import swings


def test_an_offset_that_a_soft_bristle_would_take_in() -> None:
    """The base model makes the bristle so soft that its unknown start deflections hold the offset."""
    plant = Plant(
        coulomb=0.0467,
        static=0.0595,
        stribeck_velocity=0.0628,
        viscous=0.242,
        bristle_stiffness=0.932,
        bristle_damping=0.145,
        inertia=0.005,
        base=0.129,
        per_payload=0.507,
        effects={"torque_offset": {"offset_nm": 0.0602}},
    )
    recording = record(record_session(plant, "dynamixel", 1, SESSION, temperature=False))
    starts = base_of_rows(recording, "lugre", "auto").fits
    found = diagnose(recording, starts, [registry.get(n) for n in ("torque_offset", "inertia")])
    assert found.base.values["bristle_stiffness"] < 0.1
    assert [effect.name for effect in found.effects] == ["torque_offset"]
    held_out = found.to_document()["error"]["held_out"]
    assert held_out["after"] < 0.4 * held_out["before"]


def test_a_cable_in_a_slow_sweep(tmp_path: Path) -> None:
    """What a straight spring leaves of it is slow too and looks like chance; the whole shape is a spring,
    and no ripple."""
    t = 0.01 * np.arange(4000)
    stroke = gaussian_filter1d(2.0 * np.abs(2.0 * ((t / 20.0) % 1.0) - 1.0) - 1.0, 8, mode="nearest")
    q = 1.2 * stroke
    w = np.gradient(q, 0.01)
    cable = 0.03 * stroke + 0.04 * (2.0 * stroke**2 - 1.0) + 0.06 * (4.0 * stroke**3 - 3.0 * stroke)
    noise = 0.002 * np.random.default_rng(0).normal(size=len(t))
    torque = 0.06 * np.tanh(w / 0.005) + 0.05 * w + cable + noise
    frame = pd.DataFrame({"trial": 0, "time_s": t, "position_rad": np.round(q, 5), "torque_nm": torque})
    frame.to_csv(tmp_path / "sweep.csv", index=False)
    found = identify([Log.read(tmp_path / "sweep.csv")]).diagnosis
    assert [effect["name"] for effect in found["effects"]] == ["position_stiffness", "inertia"]
    assert found["error"]["held_out"]["after"] < 0.0022


def with_offset(folder: Path, spring: float = 0.0) -> Recording:
    """An axis with an offset of 0.03 N m, and a spring (N m/rad), that nobody declared."""
    rng = np.random.default_rng(0)

    def torque(t: Array, q: Array, w: Array) -> Array:
        return 0.06 * np.tanh(w / 0.005) + 0.05 * w + 0.03 + spring * q + 0.001 * rng.normal(size=len(t))

    swings(torque).to_csv(folder / "log.csv", index=False)
    return record([Log.read(folder / "log.csv")])


def test_what_a_vetoed_effect_kept_out_is_looked_for_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An offset is a special case of a spring: where the held-out rows turn the spring down it comes back."""
    recording = with_offset(tmp_path, spring=0.01)

    def squares(fit: JointFit, parts: object, beside: object = None) -> Array:
        names = {effect.name for effect in fit.model.spec.effects}
        return np.full(30, 9.0 if "position_stiffness" in names else 1.0 if "torque_offset" in names else 4.0)

    monkeypatch.setattr(diagnosis, "held_out_squares", squares)
    starts = base_of_rows(recording, "coulomb", "none").fits
    library = [registry.get(name) for name in ("torque_offset", "position_stiffness", "inertia")]
    found = diagnose(recording, starts, library)
    assert [effect.name for effect in found.effects] == ["torque_offset"]
    assert "no better with it" in found.selection.candidates["position_stiffness"].why


def test_a_delay_that_damping_stood_for(shared: Path) -> None:
    """The base model gave up the bristle's damping and the inertia for it: from there no score tells a delay,
    and a fit with it does."""
    logs = [Log.read(path) for path in sorted((shared / "sessions" / "transport_delay").glob("s*.csv.gz"))]
    recording = record(logs)
    starts = base_of_rows(recording, "lugre", "auto").fits
    library = [registry.get(name) for name in ("transport_delay", "compliance", "inertia")]
    found = diagnose(recording, starts, library)
    assert [effect.name for effect in found.effects] == ["transport_delay"]
    assert found.base.values["bristle_damping"] < 0.01
    assert abs(found.final.values["transport_delay.delay"] + 0.04) < 0.002


class _UnderLoad(Effect):
    """Has a second number where the load changes by more than it ever does before the fit."""

    name, title, follows = "under_load", "Under load", ("load",)
    formula = reveals = citation = ""
    coordinates = (Coordinate("plain"), Coordinate("loaded"))

    def active(self, motion: Motion) -> tuple[Coordinate, ...]:
        load = motion.load
        return self.coordinates[: 1 + (load is not None and float(np.ptp(load)) > 0.1)]

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=sum(values.values()) * np.cos(3.0 * motion.position))


def test_an_effect_that_shows_more_under_its_own_load(tmp_path: Path) -> None:
    """The load is that of the fit's own gravity: a model that gains a number by it is fitted again."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(800)
    trials = []
    for k in range(4):
        speed, omega = 0.5 + 0.2 * k, 0.5 * np.pi
        w, q = speed * np.sin(omega * t), -speed / omega * np.cos(omega * t)
        torque = 0.06 * np.tanh(w / 0.05) + 0.05 * w + 0.8 * np.sin(q) + 0.001 * rng.normal(size=len(t))
        trials.append(pd.DataFrame({"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque}))
    pd.concat(trials).to_csv(tmp_path / "log.csv", index=False)
    fit = base_of_rows(record([Log.read(tmp_path / "log.csv")]), "coulomb", "arm").fits[0]
    light = fit.model.recording.with_load(*(1e-3 * np.sin(fit.model.recording.motion.position),) * 2)
    before = refit(
        fit, JointModel.build(light, fit.model.spec.adding(_UnderLoad())), {"under_load.plain": 0.0}
    )
    after = selection._with_its_own_load(before)
    assert [name for name in after.model.names if name not in before.model.names] == ["under_load.loaded"]
    assert len(after.x) == len(after.model.names)


@pytest.fixture(scope="module")
def offset_axis(tmp_path_factory: pytest.TempPathFactory) -> JointFit:
    """The base fit of an axis with an offset of 0.03 N m that nobody declared."""
    fit = base_of_rows(with_offset(tmp_path_factory.mktemp("offset")), "coulomb", "none").fits[0]
    return fit


def test_of_two_that_promise_the_same_but_for_rounding_the_simpler_comes_first(
    offset_axis: JointFit,
) -> None:
    fit = offset_axis
    effects = [registry.get(name) for name in ("torque_offset", "tilt_misalignment", "position_stiffness")]
    starts = [Start(gain, 1e-20, {}) for gain in (0.5, 0.5 + 1e-15, 0.6)]
    scored = [selection._Scored(*each, fit, each[1]) for each in zip(effects, starts, strict=True)]
    assert scored[1].left() < scored[0].left()
    promising = selection._promising(selection.begun(fit, effects), scored)
    assert [item.effect for item in promising] == [effects[2], *effects[:2]]


def test_the_best_has_to_be_it_at_the_end_of_its_fit(
    offset_axis: JointFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fit that was cut short can promise what it does not come to."""
    effects = [registry.get(name) for name in ("torque_offset", "direction_asymmetry")]
    offset, asymmetry = trials = [try_effect(offset_axis, e, best_start(offset_axis, e)) for e in effects]
    better, second = sorted(trials, key=lambda trial: trial.fit.sse)
    assert (better, second) == (offset, asymmetry)

    def completed(fit: JointFit) -> JointFit:
        return offset_axis if fit is better.fit else fit

    for ends, accepted in ((completed, second), (lambda fit: fit, better)):
        chosen = selection.begun(offset_axis, effects)
        monkeypatch.setattr(selection, "completed", ends)
        winner = selection._accepted(chosen, list(trials))
        assert winner is not None
        assert winner.effect is accepted.effect
        assert chosen.fit is accepted.fit
        told = chosen.candidates["torque_offset"].why
        assert ("in the end" in told) == (accepted is second)
    monkeypatch.setattr(selection, "completed", lambda fit: offset_axis)
    assert selection._accepted(selection.begun(offset_axis, effects), list(trials)) is None


def test_a_lag_that_cannot_be_but_leaves_least_brings_the_others(
    offset_axis: JointFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it follows is there, be it by another lag, whose own score may tell nothing."""
    library = [registry.get(name) for name in ("torque_offset", "backlash", "hysteresis")]
    tried: list[str] = []

    def in_full(chosen: object, fit: JointFit, effect: Effect, library: object) -> list[Trial]:
        tried.append(effect.name)
        return []

    def promising(chosen: object, scored: list[selection._Scored]) -> list[selection._Scored]:
        return [one for one in scored if one.effect.name != "hysteresis"]

    monkeypatch.setattr(selection, "_in_full", in_full)
    monkeypatch.setattr(selection, "_promising", promising)
    for lag, brings in ((0.9, True), (1.1, False)):
        errors = {"torque_offset": 1.0, "backlash": lag}

        def error(fit: JointFit, errors: dict[str, float] = errors) -> float:
            return min((errors.get(e.name, 2.0) for e in fit.model.spec.effects), default=2.0)

        monkeypatch.setattr(selection, "left_out_error", error)
        monkeypatch.setattr(
            selection,
            "passing",
            lambda chosen, trial: [trial] if trial.effect.name == "torque_offset" else [],
        )
        tried.clear()
        winner = selection.next_effect(selection.begun(offset_axis, library), library, lambda _: None)
        assert winner is not None
        assert winner.effect.name == "torque_offset"
        assert (tried != []) == brings
        assert set(tried) <= {"hysteresis"}


class _LikeAnOffset(Effect):
    """Nearly constant over the stroke, so that it stands for an offset in part."""

    name, title, follows = "like_an_offset", "Like an offset", ("position",)
    formula = reveals = citation = ""
    parameters = ()
    coordinates = (Coordinate("size"),)

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        return Contribution(torque=values["size"] * (1.0 + 0.8 * np.sin(3.0 * motion.position)))

    def implausible(self, values: Values, of_fit: Values) -> str:
        return "there is too little of it" if values["size"] < 0.005 else ""


def test_what_came_in_for_another_effect_makes_room_for_it(offset_axis: JointFit) -> None:
    """It cannot be beside the true one, of which it had taken a part; that does not speak against that."""
    fit = offset_axis
    offset = registry.get("torque_offset")
    chosen = selection.begun(fit, [offset])
    wrong = JointModel.build(fit.model.recording, fit.model.spec.adding(_LikeAnOffset()))
    chosen.fit = refit(fit, wrong, {"like_an_offset.size": 0.0})
    chosen.candidates["like_an_offset"] = Candidate("like_an_offset", accepted=True)
    selection.extend(chosen, [offset], given=True)
    assert {effect.name for effect in chosen.fit.model.spec.effects} == {"torque_offset", "inertia"}
    assert not chosen.candidates["like_an_offset"].accepted
    assert "took its place" in chosen.candidates["like_an_offset"].why
    assert chosen.fit.values["torque_offset.offset"] == pytest.approx(0.03, rel=0.05)


@pytest.mark.parametrize(
    ("errors", "rounds"), [((0.9, 0.7, 0.5), 3), ((1.1, 0.5, 0.4), 1), ((0.9, 0.85, 0.4), 2), ((0.9,), 1)]
)
def test_a_search_goes_on_while_it_is_ahead_of_where_another_was_a_round_before(
    errors: tuple[float, ...], rounds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other came from an error of 1 by one of 0.8 to one of 0.6."""
    known = {f"other {k}": 1.0 - 0.2 * k for k in range(3)} | {f"round {k}": e for k, e in enumerate(errors)}
    found = Selection("begin", {})  # type: ignore[arg-type]

    def next_effect(chosen: Selection, library: object, tell: object) -> Trial | None:
        done = len(chosen.steps)
        if done == len(errors):
            return None
        chosen.fit = f"round {done}"  # type: ignore[assignment]
        return Trial(registry.get("torque_offset"), chosen.fit, 0.0)

    monkeypatch.setattr(selection, "next_effect", next_effect)
    monkeypatch.setattr(selection, "good_enough", lambda fit, tolerance: False)
    monkeypatch.setattr(selection, "left_out_error", known.__getitem__)
    path = [f"other {k}" for k in range(3)]
    selection.one_by_one(found, [], lambda _: None, path=path)  # type: ignore[arg-type]
    assert len(found.steps) == rounds
