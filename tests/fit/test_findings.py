"""Sentences on a fit that its reader must know."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log
from idtool.effects import registry
from idtool.fit.findings import findings
from idtool.fit.joint import refit
from idtool.fit.model import JointModel
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows


@pytest.mark.parametrize("with_position", [True, False])
@pytest.mark.parametrize("lag", ["transport_delay", "backlash", "torque_offset"])
def test_a_lag_of_a_speed_alone_may_be_that_of_a_drive_s_filter(lag: str, with_position: bool) -> None:
    rng, time = np.random.default_rng(0), 0.01 * np.arange(3000)
    position, speed = np.sin(time) + 0.2 * np.sin(4.1 * time), np.cos(time) + 0.82 * np.cos(4.1 * time)
    frame = pd.DataFrame({"trial": 0, "time_s": time, "velocity_rad_s": speed})
    frame["torque_nm"] = 0.1 * np.tanh(speed / 0.01) + 0.05 * speed + 0.002 * rng.normal(size=len(time))
    if with_position:
        frame["position_rad"] = np.round(position, 4)
    fit = base_of_rows(record([Log(frame, Axis(), source="log.csv")]), "coulomb", "none").fits[0]
    effect = registry.get(lag)
    found = refit(fit, JointModel.build(fit.model.recording, fit.model.spec.adding(effect)), _nothing(lag))
    told = [note for note in findings(found) if "no position was logged" in note]
    assert bool(told) == (lag != "torque_offset" and not with_position)
    assert all(effect.title.lower() in note for note in told)


def _nothing(name: str) -> dict[str, float]:
    """Coordinates of an effect that does nothing."""
    return {f"{name}.{c.name}": c.null for c in registry.get(name).coordinates}


@pytest.mark.parametrize("both_ways", [True, False])
def test_one_way_a_torque_over_the_position_may_as_well_be_friction(both_ways: bool) -> None:
    rng, time = np.random.default_rng(0), 0.01 * np.arange(2000)
    speed = 0.2 + 0.05 * np.sin(2.0 * time)
    way = np.sign(np.sin(0.4 * time)) if both_ways else np.ones(len(time))
    position = np.cumsum(0.01 * way * speed)
    torque = way * (0.1 + 0.05 * speed) + 0.02 * position + 0.001 * rng.normal(size=len(time))
    frame = {"trial": 0, "time_s": time, "position_rad": np.round(position, 4), "torque_nm": torque}
    fit = base_of_rows(record([Log(pd.DataFrame(frame), Axis(), source="log.csv")]), "coulomb", "none").fits[
        0
    ]
    spec = fit.model.spec.adding(registry.get("position_stiffness"))
    model = JointModel.build(fit.model.recording, spec)
    found = refit(fit, model, {"position_stiffness.stiffness": 0.0, "position_stiffness.pull": 0.0})
    told = [note for note in findings(found) if "one direction only" in note]
    assert bool(told) is not both_ways
    assert all("position stiffness from friction along the stroke" in note for note in told)
