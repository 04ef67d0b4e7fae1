"""How a refit with an effect begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.diagnosis import candidates
from idtool.diagnosis.candidates import Start, best_start, try_effect
from idtool.diagnosis.plausible import impossible
from idtool.effects import registry
from idtool.effects.hysteresis import Hysteresis
from idtool.effects.torque_constant_saturation import per_torque
from idtool.fit.joint import JointFit
from idtool.fit.left_out import left_out_error
from idtool.model.motion import since_reversal
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from testbench.plants import TORQUE_CONSTANT, Plant, record_session
from tests.diagnosis.conftest import LEVEL, REACH


@pytest.fixture(scope="module")
def one_way(tmp_path_factory: pytest.TempPathFactory) -> JointFit:
    """An axis that a spring brakes and that moves one way only: an offset and the Coulomb level are one."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(600)
    trials = []
    for k in range(6):
        w = (0.3 + 0.1 * k) * np.clip(t / 3.0, 0.0, 1.0) ** 2
        q = 0.01 * np.cumsum(w)
        torque = 0.04 * (w > 0.0) + 0.02 * w + 0.004 * q**2 + 0.0003 * rng.normal(size=len(t))
        trials.append(pd.DataFrame({"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque}))
    path = tmp_path_factory.mktemp("one_way") / "log.csv"
    pd.concat(trials).to_csv(path, index=False)
    fit = base_of_rows(record([Log.read(path)]), "lugre", "auto").fits[0]
    return fit


@pytest.mark.parametrize("pull", [0.01, 10.0])
def test_never_above_the_fit_that_it_extends(
    one_way: JointFit, pull: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A start that asks the rest to move by more than there is of it is none."""
    monkeypatch.setattr(candidates, "_SPENT", 1)
    start = Start(0.5, 1e-6, {"stiffness": 0.01, "pull": pull})
    trial = try_effect(one_way, registry.get("position_stiffness"), start)
    assert trial.fit.sse <= 1.001 * one_way.sse


def test_an_element_takes_friction_over_from_the_bristle(slipping: JointFit) -> None:
    part = Hysteresis(of_friction=True)
    trial = try_effect(slipping, part, best_start(slipping, part), far=True)
    values = trial.fit.values
    assert trial.effect == part
    assert left_out_error(trial.fit) < 0.3 * left_out_error(slipping)
    assert values["coulomb"] == pytest.approx(LEVEL, rel=0.02)
    assert values["hysteresis.yield"] > 0.8 * LEVEL
    assert np.exp(values["hysteresis.log_reach"]) == pytest.approx(REACH, rel=0.1)
    assert impossible(trial.fit, part) is None


def test_it_is_refitted_from_other_starts_than_its_best_score(slipping: JointFit) -> None:
    part = Hysteresis(of_friction=True)
    wrong, right = ({"yield": 1e-4, "log_reach": float(np.log(share))} for share in (12.0 * REACH, REACH))
    alone = try_effect(slipping, part, Start(0.5, 1e-6, wrong), far=True)
    both = try_effect(slipping, part, Start(0.5, 1e-6, wrong, (right,)), far=True)
    assert both.fit.sse < 0.2 * slipping.sse
    assert both.fit.sse <= alone.fit.sse


def with_a_curve(fit: JointFit, *, where_it_slides: bool) -> JointFit:
    """The fit with quadratic friction that shows on rows of steady sliding alone, or on the others alone."""
    fit = try_effect(fit, registry.get("nonlinear_viscous"), Start(0.1, 1e-6, {"quadratic": 0.0})).fit
    motion, row = fit.model.recording.motion, fit.model.recording.row
    travel = since_reversal(motion.position, motion.velocity, motion.trial)[row]
    own = np.array(fit.model.names) == "nonlinear_viscous.quadratic"
    absent = (travel > 2.0 * REACH) != where_it_slides
    size = 0.05
    column = fit.jacobian[: len(row), own][:, 0]
    return replace(fit, x=fit.x + size * own, residual=fit.residual - size * column * absent)


def test_a_curve_of_sliding_shows_where_the_axis_slides(slipping: JointFit) -> None:
    """Beside a presliding that is none of LuGre's, what shows after the reversals alone is no such curve."""
    part, curve = Hysteresis(of_friction=True), registry.get("nonlinear_viscous")
    bent = try_effect(slipping, part, best_start(slipping, part), far=True).fit
    assert impossible(with_a_curve(bent, where_it_slides=True), curve) is None
    assert "slides steadily" in (impossible(with_a_curve(bent, where_it_slides=False), curve) or "")
    # a bristle of LuGre's knows what it leaves after a reversal
    assert "slides" not in (impossible(with_a_curve(slipping, where_it_slides=False), curve) or "")


def test_presliding_within_a_row_or_two_after_a_turn_is_not_seen(slipping: JointFit) -> None:
    part = Hysteresis(of_friction=True)
    bent = try_effect(slipping, part, best_start(slipping, part), far=True).fit
    at = bent.model.names.index("hysteresis.log_reach")
    for share, why in ((1.0, None), (1e-4, "rows after a turn")):
        x = bent.x.copy()
        x[at] += np.log(share)
        found = impossible(replace(bent, x=x), part)
        assert found is None if why is None else why in str(found)


def test_friction_takes_power_both_ways(slipping: JointFit) -> None:
    """An asymmetry beyond friction would drive the axis one way, as it seems where a torque lost its sign."""
    effect = registry.get("direction_asymmetry")
    with_it = try_effect(slipping, effect, Start(0.5, 1e-6, {"asymmetry": 0.0})).fit
    speed = with_it.model.recording.motion.velocity
    friction = with_it.model.friction(with_it.x)
    # the least that leaves none of the power that friction takes, over the rows that go one way
    power = {
        way: float(np.sum((friction.coulomb * w + friction.viscous * w**2)[w > 0.0]))
        for way, w in ((1, speed), (-1, -speed))
    }
    most = {way: power[way] / float(np.sum(speed[way * speed > 0.0] ** 2)) for way in power}
    at = with_it.model.names.index("direction_asymmetry.asymmetry")
    for way, least in most.items():
        for share, possible in ((0.95, True), (1.05, False)):
            x = with_it.x.copy()
            x[at] = -way * share * least
            why = impossible(replace(with_it, x=x), effect)
            assert (why != "friction would drive the axis one way") == possible


def test_a_fall_that_is_not_seen_has_no_shape(slipping: JointFit) -> None:
    """The static level is the Coulomb level there."""
    shape = registry.get("stribeck_shape")
    bent = try_effect(slipping, shape, Start(0.5, 1e-6, {"exponent": 1.5})).fit
    x = bent.x.copy()
    x[bent.model.names.index("stribeck_shape.exponent")] = 1.5
    x[bent.model.names.index("static")] = x[bent.model.names.index("coulomb")]
    assert "has no shape" in str(impossible(replace(bent, x=x), shape))
    x[bent.model.names.index("static")] += 5.0
    assert "has no shape" not in str(impossible(replace(bent, x=x), shape))


@pytest.mark.parametrize("constant", [TORQUE_CONSTANT, None], ids=["current", "torque alone"])
@pytest.mark.parametrize(("kappa", "possible"), [(0.08, True), (-0.08, False)])
def test_a_motor_gives_no_more_torque_per_ampere_at_high_current(
    kappa: float, possible: bool, constant: float | None
) -> None:
    """What looks like that is something else. A log may hold the torque alone that a drive computes."""
    plant = Plant(0.080, 0.115, 0.080, 0.120, 8.0, 0.20, 0.008, 0.20, 0.42)
    plain = record(record_session(plant, "lab", 3, ("gravity", "sweep")))
    current = plain.torque / TORQUE_CONSTANT
    for _ in range(30):  # the current that gives this torque by K i (1 - kappa |i|)
        current = plain.torque / TORQUE_CONSTANT / (1.0 - kappa * np.abs(current))
    motion = replace(plain.motion, torque_constant=constant)
    spoilt = replace(plain, torque=TORQUE_CONSTANT * current, motion=motion)
    fit = base_of_rows(spoilt, "lugre", "auto").fits[0]
    effect = registry.get("torque_constant_saturation")
    trial = try_effect(fit, effect, best_start(fit, effect))
    values = trial.fit.model.effect_values(trial.fit.x, effect)
    assert TORQUE_CONSTANT * per_torque(values, constant) == pytest.approx(kappa, rel=0.2)
    assert ("loss" in values) == (constant is None)
    why = impossible(trial.fit, effect)
    assert (why is None) == possible
    assert possible or "cannot be" in str(why)


def test_a_start_that_is_not_scored_has_all_that_its_effect_needs(
    slipping: JointFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wave that beats with the motion is tried all the same in the place of one that looks like it."""
    monkeypatch.setattr(candidates, "beats_with_motion", lambda motion, frequency: True)
    fit, wave = replace(slipping), registry.get("external_periodic")
    start = best_start(fit, wave)
    assert start.gain == 0.0
    assert set(start.values) == {c.name for c in wave.active(fit.model.recording.motion)}
    assert try_effect(fit, wave, start).fit.sse <= 1.01 * fit.sse
