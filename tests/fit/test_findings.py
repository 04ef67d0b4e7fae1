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
