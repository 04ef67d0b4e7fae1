"""Lines are placed well enough that what they leave is noise, in the torque and in the friction."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log, Parameters, identify
from idtool.diagnosis.evidence import background_of
from idtool.diagnosis.lines import strongest_line
from idtool.effects import registry
from idtool.fit.joint import JointFit
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from idtool.verbs.predict import predict

#: Of the torque that beats, Hz and N m.
BEATS, AMPLITUDE = 1.0454, 0.02
#: Of the friction along the stroke, waves per turn and share of the Coulomb level.
WAVES, SHARE = 9.0, 0.3


def session(path: Path, beats: float, share: float, on_one_clock: int = 6) -> Log:
    """Six trials of a sine: a torque that beats, and a bristle (Dahl) whose friction follows the place."""
    rng = np.random.default_rng(1)
    t = 0.01 * np.arange(800)
    trials = []
    for k in range(6):
        speed, omega = 0.5 + 0.2 * k, 2.0 * np.pi / 4.0
        w, q = speed * np.sin(omega * t), -speed / omega * np.cos(omega * t)
        now = t + 8.7 * k
        level = 0.06 * (1.0 + share * np.sin(WAVES * q))
        friction = np.zeros(len(t))
        for n in range(1, len(t)):
            bound = np.sign(q[n] - q[n - 1]) * level[n]
            friction[n] = bound + (friction[n - 1] - bound) * np.exp(-6.0 * abs(q[n] - q[n - 1]) / level[n])
        torque = friction + 0.05 * w + beats * np.sin(2.0 * np.pi * BEATS * now)
        torque += 0.001 * rng.normal(size=len(t))
        told = t + 8.7 * (k % on_one_clock)
        trials.append(pd.DataFrame({"trial": k, "time_s": told, "position_rad": q, "torque_nm": torque}))
    pd.concat(trials).to_csv(path, index=False)
    return Log.read(path)


def base(log: Log) -> JointFit:
    starts = base_of_rows(record([log]), "lugre", "auto").fits
    return starts[0]


def test_a_line_between_two_of_the_spectrum(tmp_path: Path) -> None:
    """Half a wave off over the session it would leave beats, which make its own evidence look like chance."""
    background = background_of(base(session(tmp_path / "log.csv", AMPLITUDE, 0.0)))
    recording = background.recording
    wave = registry.get("external_periodic").wave(recording.motion)
    assert wave is not None
    of = wave.of[recording.row]
    frequency, _ = strongest_line(background, of, wave.lowest, 20.0)
    whole = 6 * 8.7
    assert frequency == pytest.approx(BEATS, abs=0.02 / whole)


def test_each_clock_that_starts_anew_has_its_own_phase(tmp_path: Path) -> None:
    """With one phase for all of them the waves of the three cancel each other."""
    log = session(tmp_path / "log.csv", AMPLITUDE, 0.0, on_one_clock=2)
    found = identify([log])
    (beat,) = (effect for effect in found.parameters.effects if effect.name == "external_periodic")
    values = beat.values()
    assert values["frequency"] == pytest.approx(BEATS, abs=0.001)
    held_out = found.diagnosis["error"]["held_out"]
    assert held_out["after"] < 0.2 * held_out["before"]
    for k, own in enumerate(("", "_2", "_3")):
        assert values[f"amplitude{own}"] == pytest.approx(AMPLITUDE, rel=0.03)
        off = values[f"phase{own}"] - 2.0 * np.pi * BEATS * 2 * 8.7 * k
        assert abs(math.remainder(off, 2.0 * np.pi)) < 0.1
    # the file is read as it was written, and each clock has its own again
    found.parameters.write(tmp_path / "params.toml")
    again = predict([log], Parameters.read(tmp_path / "params.toml")).errors["other"]["rmse"]
    assert again == pytest.approx(held_out["after"], rel=0.1)


def test_friction_that_comes_and_goes_along_the_stroke(tmp_path: Path) -> None:
    """It has no line in the torque, since it turns with the motion."""
    found = identify([session(tmp_path / "log.csv", 0.0, SHARE)])
    assert [effect["name"] for effect in found.diagnosis["effects"] if effect["name"] != "inertia"] == [
        "position_ripple"
    ]
    (ripple,) = (effect for effect in found.parameters.effects if effect.name == "position_ripple")
    values = ripple.values()
    assert values["cycles"] == pytest.approx(WAVES, rel=0.01)
    assert values["turned_amplitude_1"] == pytest.approx(0.06 * SHARE, rel=0.1)
    held_out = found.diagnosis["error"]["held_out"]
    assert held_out["after"] < 0.2 * held_out["before"]
