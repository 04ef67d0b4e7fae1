"""What changes the motor's torque per current: an effect from outside, from the data to the board."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.control.load import Instant
from idtool.control.online import OnlineModel
from idtool.diagnosis.diagnose import diagnose
from idtool.effects import registry
from idtool.effects.base import CForm, Coordinate, Effect, EffectParameter, Values
from idtool.model.contribution import Contribution
from idtool.model.motion import Motion
from idtool.model.torque import Friction, predict
from idtool.parameters import EffectEntry, Parameter
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from idtool.verbs.simulate import simulate
from testbench.pendulums import Pendulum
from tests.control.double import BENCH, parameters
from tests.export.test_c import assert_alike
from tests.export.twin import compile_c, motion, run_c, run_python

CYCLES = 4.0
VALUES = {"sine": 0.15, "cosine": -0.1}


class MotorCogging(Effect):
    """Cogging that grows with the current: the torque constant changes over a turn."""

    name = "motor_cogging"
    title = "Motor cogging"
    follows = ("position",)
    formula = "K (1 + a sin(4 q) + b cos(4 q))"
    reveals = "a slow sweep under load"
    citation = "any text on brushless motors"
    page = "https://example.org/cogging"
    parameters = (EffectParameter("sine", "number", "a"), EffectParameter("cosine", "number", "b"))
    coordinates = (Coordinate("sine"), Coordinate("cosine"))

    def contribute(self, motion: Motion, values: Values) -> Contribution:
        angle = CYCLES * motion.position
        return Contribution(gain_change=values["sine"] * np.sin(angle) + values["cosine"] * np.cos(angle))

    def in_c(self, values: Values) -> CForm:
        code = """
            float s, c;
            sine_and_cosine(4.0f * row->position, &s, &c);
            sum->gain_change += sine * s + cosine * c;
        """
        return CForm(code, values)


@pytest.fixture(autouse=True)
def known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_OF_THIS_PROCESS", {})
    registry.add(MotorCogging())


def test_is_found_in_data_and_not_taken_for_a_ripple(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(1500)
    trials = []
    for k in range(6):
        speed, omega, load = 0.4 + 0.1 * k, 0.4 * np.pi, 0.5 * (k % 3)
        w, q = speed * np.sin(omega * t), -speed / omega * np.cos(omega * t)
        torque = 0.06 * np.tanh(w / 0.02) + 0.05 * w + 0.2 + load
        torque /= 1.0 + VALUES["sine"] * np.sin(CYCLES * q) + VALUES["cosine"] * np.cos(CYCLES * q)
        torque += 0.001 * rng.normal(size=len(t))
        columns = {"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque, "payload_kg": load}
        trials.append(pd.DataFrame(columns))
    pd.concat(trials).to_csv(tmp_path / "log.csv", index=False)
    recording = record([Log.read(tmp_path / "log.csv")])
    starts = base_of_rows(recording, "coulomb", "auto").fits
    names = ("position_ripple", "position_stiffness", "inertia", "drive_backdrive")
    found = diagnose(recording, starts, [MotorCogging(), *map(registry.get, names)])
    assert [effect.name for effect in found.effects] == ["motor_cogging"]
    for name, value in VALUES.items():
        assert found.final.values[f"motor_cogging.{name}"] == pytest.approx(value, abs=0.002)


def test_the_controller_takes_it_off() -> None:
    """What arrives of the current that the model predicts is what the axis carries."""
    time = 0.002 * np.arange(3000)
    position = 0.8 * np.sin(2.0 * time)
    velocity = np.gradient(position, time)
    acceleration = np.gradient(velocity, time)
    m = Motion(time, np.zeros(len(time), dtype=np.intp), position, velocity, acceleration)
    file = parameters(BENCH, motor_cogging=VALUES)
    effect = MotorCogging().contribute(m, VALUES)
    model = OnlineModel(file)
    friction = Friction(
        model.coulomb,
        model.static,
        model.stribeck_velocity,
        model.viscous,
        model.bristle_stiffness,
        model.bristle_damping,
    )
    weight = model.gravity(0.0, 0.0)
    wanted = predict(
        m, friction, Contribution(torque=weight, gain_change=effect.gain_change), np.zeros(1), settled=False
    )
    for k in range(len(m)):
        step = 0.0 if k == 0 else float(time[k] - time[k - 1])
        load = model.update(
            Instant(float(time[k]), step, float(position[k]), float(velocity[k]), float(acceleration[k]))
        )
        assert load.arriving(float(wanted.torque[k])) == pytest.approx(load.total, rel=1e-9, abs=1e-12)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize(
    "beside", [{}, {"torque_constant_saturation": {"kappa": 0.03}}], ids=["alone", "beside"]
)
def test_so_does_the_board(beside: dict[str, dict[str, float]], tmp_path: Path) -> None:
    file = parameters(BENCH, motor_cogging=VALUES, **beside)
    samples = motion(4000, 0.01, seed=1)
    assert_alike(run_c(compile_c(file, tmp_path), samples), run_python(file, samples))


def test_a_simulation_has_it() -> None:
    """The effort that stands for less torque at a place moves the axis as that torque does."""
    swing = Pendulum()
    log = swing.log(seconds=4.0, noise=0.0)
    plain = swing.parameters()
    cogging = EffectEntry("motor_cogging", {name: Parameter(value) for name, value in VALUES.items()})
    found = simulate(log, replace(plain, effects=(*plain.effects, cogging)))
    angle = CYCLES * found.frame["position_simulated_rad"]
    arriving = 1.0 + VALUES["sine"] * np.sin(angle) + VALUES["cosine"] * np.cos(angle)
    told = log.frame.assign(current_a=log.frame["current_a"] * arriving)
    other = simulate(replace(log, rows=told), plain)
    apart = found.frame["position_simulated_rad"] - other.frame["position_simulated_rad"]
    assert np.abs(apart).max() < 0.002
    without = simulate(log, plain).frame["position_simulated_rad"]
    assert np.abs(found.frame["position_simulated_rad"] - without).max() > 0.02
