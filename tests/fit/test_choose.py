"""Which friction law the data carry, where the bristle bends far."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.effects import registry
from idtool.errors import InputError
from idtool.fit import choose
from idtool.fit.choose import bending_fits, choose_gravity, first_fit, first_fits
from idtool.fit.identifiability import no_reversal
from idtool.fit.joint import JointFit, refit
from idtool.fit.model import JointModel
from idtool.fit.restart import rises, rises_all_along
from idtool.fit.spec import Spec
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion
from idtool.model.torque import Friction, predict
from idtool.signals import Recording, record
from idtool.verbs.base_model import base_of_rows
from testbench.diagnosis_cases import record as recorded
from testbench.outcomes import Case


def _first(log: Path) -> JointFit:
    fit = base_of_rows(record([Log.read(log)]), "lugre", "none").fits[0]
    return fit


def test_a_bristle_at_the_soft_end_of_its_range_is_no_rigid_one(tmp_path: Path) -> None:
    """It bends over a little more of the stroke than a first fit lets it, while an effect is missing."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(1200)
    friction = Friction(0.1, 0.1, 0.1, 0.15, 0.1 / 1.15, 0.15)
    trials = []
    for k in range(4):
        slow, fast = 2.0 * np.pi / (11.0 + k), 2.0 * np.pi / (2.6 + 0.3 * k)
        q = 1.5 * np.sin(slow * t) + 0.5 * np.sin(fast * t)
        w = 1.5 * slow * np.cos(slow * t) + 0.5 * fast * np.cos(fast * t)
        a = -1.5 * slow**2 * np.sin(slow * t) - 0.5 * fast**2 * np.sin(fast * t)
        motion = Motion(t, np.zeros(len(t), dtype=np.intp), q, w, a)
        torque = predict(motion, friction, Contribution(torque=-0.06 * np.abs(w)), np.zeros(1)).torque
        torque = torque + 0.002 * rng.normal(size=len(t))
        trials.append(pd.DataFrame({"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque}))
    pd.concat(trials).to_csv(tmp_path / "log.csv", index=False)
    fit = _first(tmp_path / "log.csv")
    assert fit.model.spec.friction == "lugre"
    assert fit.at_bound["bristle_stiffness"]
    assert not fit.rigid


def test_a_torque_that_fades_after_one_start_is_no_presliding(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(1500)
    w = 3.0 * (1.0 - np.exp(-t / 0.5))
    q = 0.01 * np.cumsum(w)
    torque = 0.05 + 0.01 * w - 0.04 * np.exp(-q / 8.0) + 0.001 * rng.normal(size=len(t))
    pd.DataFrame({"time_s": t, "position_rad": q, "torque_nm": torque}).to_csv(
        tmp_path / "log.csv", index=False
    )
    assert _first(tmp_path / "log.csv").model.spec.friction != "lugre"


@pytest.mark.long
def test_a_level_at_rest_that_ran_away_does_not_cost_the_bristle() -> None:
    """How far it bends is told by the level of sliding; that of standstill is anything at these speeds."""
    session = recorded(Case("one effect", 4275901015, ("compliance",), sensors="dynamixel", hard=True))
    starts = base_of_rows(record(session.logs), "lugre", "auto").fits
    assert starts[0].at_bound["static"]
    assert starts[0].model.spec.friction == "lugre"


def test_friction_that_fades_in_with_speed_is_no_constant_level(tmp_path: Path) -> None:
    """Its static level is all but nothing: no error of the logarithm tells that from chance."""
    rng = np.random.default_rng(0)
    t = 0.005 * np.arange(6000)
    slow, fast = 2.0 * np.pi / 9.0, 2.0 * np.pi / 2.3
    w = 0.9 * slow * np.cos(slow * t) + 0.2 * fast * np.cos(fast * t)
    q = 0.9 * np.sin(slow * t) + 0.2 * np.sin(fast * t)
    torque = 0.1 * np.tanh(w / 0.02) + 0.05 * w + 0.002 * rng.normal(size=len(t))
    q = np.round(q / 1e-5) * 1e-5
    pd.DataFrame({"time_s": t, "position_rad": q, "torque_nm": torque}).to_csv(
        tmp_path / "log.csv", index=False
    )
    assert _first(tmp_path / "log.csv").model.spec.friction != "coulomb"


def _turning(folder: Path, static: float, left: float) -> Recording:
    """Sines with a friction curve from `static` to 0.1 N m, and something that a base model lacks."""
    rng, t = np.random.default_rng(0), 0.01 * np.arange(1500)
    trials = []
    for k in range(4):
        slow, fast = 2.0 * np.pi / (9.0 + k), 2.0 * np.pi / (2.6 + 0.3 * k)
        q = 0.8 * np.sin(slow * t) + 0.2 * np.sin(fast * t)
        w = 0.8 * slow * np.cos(slow * t) + 0.2 * fast * np.cos(fast * t)
        a = -0.8 * slow**2 * np.sin(slow * t) - 0.2 * fast**2 * np.sin(fast * t)
        motion = Motion(t, np.zeros(len(t), dtype=np.intp), q, w, a)
        friction = Friction(0.1, static, 0.3, 0.05, 500.0, 0.0)
        torque = predict(motion, friction, Contribution(torque=left * np.sin(7.0 * q)), np.zeros(1)).torque
        torque = torque + 0.002 * rng.normal(size=len(t))
        trials.append(pd.DataFrame({"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque}))
    pd.concat(trials).to_csv(folder / "log.csv", index=False)
    return record([Log.read(folder / "log.csv")])


def test_a_curve_that_rises_from_rest_is_not_trusted_most(tmp_path: Path) -> None:
    recording = _turning(tmp_path, 0.06, 0.02)
    spec = Spec("lugre", None, (), (registry.get("inertia"),))
    falling, rising = first_fits(recording, spec)
    assert falling.model.spec.falling
    assert not rises(falling)
    assert rising.values["static"] == pytest.approx(0.06, abs=0.01)
    assert falling.values["static"] >= falling.values["coulomb"]


@pytest.mark.parametrize(
    ("share", "viscous", "instead"), [(0.30, 0.0, False), (0.36, 0.0, True), (0.36, 0.05, False)]
)
def test_a_curve_that_rises_all_along_is_viscous_friction_by_another_name(
    share: float, viscous: float, instead: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that may only fall takes the place of one that leaves no viscous friction."""
    recording = _turning(tmp_path, 0.06, 0.02)
    spec = Spec("lugre", None, (), (registry.get("inertia"),))
    _, rising = first_fits(recording, spec)
    values = rising.values | {"stribeck_velocity": share * rising.model.scales.speed, "viscous": viscous}
    bent = replace(rising, x=rising.model.coordinates(values))
    assert rises_all_along(bent) == (share > 0.33)
    assert not rises_all_along(replace(bent, x=bent.model.coordinates(values | {"static": 0.15})))
    monkeypatch.setattr(choose, "bending_fits", lambda spec, begin: [bent])
    assert [rises(fit) for fit in first_fits(recording, spec)] == [False] + [True] * (not instead)


@pytest.mark.parametrize(("static", "left"), [(0.06, 0.0), (0.14, 0.02)])
def test_what_leaves_noise_alone_or_falls_needs_no_other_curve(
    tmp_path: Path, static: float, left: float
) -> None:
    recording = _turning(tmp_path, static, left)
    (only,) = first_fits(recording, Spec("lugre", None, (), (registry.get("inertia"),)))
    assert not only.model.spec.falling
    assert only.values["static"] == pytest.approx(static, abs=0.01)


@pytest.mark.parametrize(("share", "kept"), [(0.2, False), (0.8, True), (1.2, False)])
def test_a_bristle_that_bends_farther_than_the_stroke_is_no_base_model(
    share: float, kept: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It never slides, and holds what its start, which nobody knows, says."""
    recording, spec = _turning(tmp_path, 0.1, 0.05), Spec("lugre", None, ())
    stiff = first_fit(recording, spec)
    model = JointModel.build(recording, replace(stiff.model.spec, soft=True))
    bend = stiff.values["bristle_stiffness"] * stiff.presliding_scale
    far = stiff.values | {"bristle_stiffness": bend / (share * model.scales.travel)}
    soft = replace(stiff, model=model, x=model.coordinates(far))
    assert soft.presliding_scale == pytest.approx(share * model.scales.travel, rel=1e-3)
    monkeypatch.setattr(choose, "predicts_better", lambda one, other: True)
    fits = bending_fits(spec, lambda spec: soft if spec.soft else stiff)
    assert fits == ([stiff, soft] if kept else [stiff])


def test_a_start_among_rows_that_are_left_out_shows_no_presliding(tmp_path: Path) -> None:
    """Seen in a recording at one speed whose first rows, before an encoder slipped, are left out."""
    rng, t = np.random.default_rng(0), 0.01 * np.arange(3000)
    w = np.where(t < 5.0, np.sin(4.0 * t), 3.0 + 0.3 * np.sin(2.0 * t))
    q = 0.01 * np.cumsum(w)
    torque = 0.1 * np.tanh(w / 0.01) + 0.05 * w + 0.002 * rng.normal(size=len(t))
    path = tmp_path / "log.csv"
    pd.DataFrame({"time_s": t, "position_rad": q, "torque_nm": torque}).to_csv(path, index=False)
    whole = record([Log.read(path)])
    fit = first_fit(whole, Spec("lugre", None, ()))
    assert no_reversal(fit) is None
    late = replace(whole, usable=whole.usable & (t > 6.0))
    assert no_reversal(refit(fit, JointModel.build(late, fit.model.spec))) is not None


def swing(folder: Path, payloads: tuple[float, ...], per_payload: float) -> Recording:
    """An arm of 3 N m and `per_payload` N m/kg more; a trial under each payload."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(1500)
    q, w = 2.5 * np.sin(0.7 * t), 1.75 * np.cos(0.7 * t)
    trials = []
    for k, payload in enumerate(payloads):
        torque = 0.5 * np.tanh(w / 0.02) + (3.0 + per_payload * payload) * np.sin(q)
        torque += 0.02 * rng.normal(size=len(t))
        rows = {"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque, "payload_kg": payload}
        trials.append(pd.DataFrame(rows))
    pd.concat(trials).to_csv(folder / "log.csv", index=False)
    return record([Log.read(folder / "log.csv")])


def test_an_arm_whose_load_changes_is_refused(tmp_path: Path) -> None:
    recording = swing(tmp_path, (0.0, 0.5, 1.0), 2.4)
    with pytest.raises(
        InputError, match=r"log\.csv, payload_kg: it changes and this axis is an arm.* by itself"
    ):
        choose_gravity(recording)
    assert choose_gravity(recording, "slide")[0] == "slide"  # who knows better has the say


@pytest.mark.parametrize(
    ("payloads", "per_payload"), [((0.5, 0.5), 2.4), ((0.0, 1.0), 0.0)], ids=["one load", "carried elsewhere"]
)
def test_an_arm_under_one_load_is_an_arm(
    tmp_path: Path, payloads: tuple[float, ...], per_payload: float
) -> None:
    assert choose_gravity(swing(tmp_path, payloads, per_payload)) == ("arm", ("sin", "cos"))


def test_an_arm_shows_beside_a_torque_that_is_mostly_back_emf(tmp_path: Path) -> None:
    """... where it takes less than a twentieth of the torque's square."""
    swing(tmp_path, (0.5, 0.5), 2.4)
    rows = pd.read_csv(tmp_path / "log.csv")
    speed = np.gradient(rows["position_rad"], rows["time_s"])
    for back_emf in (8.0, 80.0):
        volts = 0.2 * (rows["torque_nm"] + back_emf * speed)
        by_duty = rows.drop(columns="torque_nm").assign(duty=volts / 48.0, supply_voltage_v=48.0)
        by_duty.to_csv(tmp_path / "log.csv", index=False)
        assert choose_gravity(record([Log.read(tmp_path / "log.csv")]))[0] == "arm"


def test_a_load_that_pulls_alike_at_each_angle_is_a_slide(tmp_path: Path) -> None:
    swing(tmp_path, (0.0, 0.5, 1.0), 0.0)
    rows = pd.read_csv(tmp_path / "log.csv")
    rows["torque_nm"] += 0.4 * rows["payload_kg"] - 3.0 * np.sin(rows["position_rad"])
    rows.to_csv(tmp_path / "log.csv", index=False)
    model, columns = choose_gravity(record([Log.read(tmp_path / "log.csv")]))
    assert (model, columns) == ("slide", ("base", "per_payload"))
