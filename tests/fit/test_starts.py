"""Where each trial's memory starts is found from the torque."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from idtool.effects import registry
from idtool.fit.model import LOGARITHMIC, JointModel
from idtool.fit.spec import Spec
from idtool.fit.starts import free_starts, settled
from idtool.log import Log
from idtool.model.torque import predict
from idtool.signals import record

VALUES = {
    "coulomb": 0.08,
    "static": 0.1,
    "stribeck_velocity": 0.08,
    "viscous": 0.12,
    "bristle_stiffness": 8.0,
    "bristle_damping": 0.1,
    "backlash.share_behind_gap": 0.6,
    "backlash.share_at_once": 0.0,
    "backlash.log_gap": math.log(0.06),
}
TRUE = np.array([-0.8, -0.3, 0.2, 0.7])


def model(tmp_path: object, noise: float) -> tuple[JointModel, np.ndarray]:
    """Four trials that differ in their start only, their torque made by the model itself."""
    time = 0.005 * np.arange(1200)
    velocity = 0.3 * np.sin(2 * np.pi * 0.25 * time) ** 3
    position = np.cumsum(velocity) * 0.005
    n = len(TRUE)
    frame = pd.DataFrame(
        {
            "trial": np.repeat(np.arange(n), len(time)),
            "time_s": np.concatenate([time + 10.0 * k for k in range(n)]),
            "position_rad": np.tile(position, n),
            "velocity_rad_s": np.tile(velocity, n),
            "torque_nm": 0.0,
        }
    )
    frame["torque_nm"] = noise * np.random.default_rng(3).standard_normal(len(frame))
    file = f"{tmp_path}/log.csv"
    frame.to_csv(file, index=False)
    recording = record([Log.read(file)])
    spec = Spec("lugre", None, (), (registry.get("backlash"),))
    made = replace(JointModel.build(recording, spec), starts={"backlash": TRUE})
    # not by `coordinates`, whose bounds would be those of a log without torque
    x = np.array([math.log(VALUES[n]) if n in LOGARITHMIC else VALUES[n] for n in made.names])
    torque = predict(recording.motion, made.friction(x), made.contribution(x), np.zeros(n)).torque
    return JointModel.build(replace(recording, torque=recording.torque + torque), spec), x


@pytest.mark.parametrize("noise", [1e-4, 2e-3])
def test_finds_the_start_of_every_trial(tmp_path: object, noise: float) -> None:
    blank, x = model(tmp_path, noise)
    assert free_starts(blank) == len(TRUE)
    found = settled(blank, x, blank.presliding_scale(x))
    np.testing.assert_allclose(found.starts["backlash"], TRUE, atol=0.0626)  # the grid's fine step
    bend = blank.presliding_scale(x)
    before, after = (np.sum(m.evaluate(x, bend).stacked ** 2) for m in (blank, found))
    assert after < 0.3 * before


def test_effects_without_a_free_start_are_left_alone(tmp_path: object) -> None:
    blank, x = model(tmp_path, 1e-4)
    plain = JointModel.build(blank.recording, Spec("lugre", None, ()))
    assert free_starts(plain) == 0
    assert settled(plain, x[:6], plain.presliding_scale(x[:6])) is plain
