"""Axes for several tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.fit.joint import JointFit
from idtool.model.motion import Array
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows

#: Of a contact that does not creep: its level, and the way over which it bends.
LEVEL, REACH = 0.04, 0.03


def swings(torque: Callable[[Array, Array, Array], Array]) -> pd.DataFrame:
    """Six swings of 8 s, each quicker than the one before.

    Args:
        torque: of time, position and velocity.
    """
    t = 0.01 * np.arange(800)
    trials = []
    for k in range(6):
        w = (0.5 + 0.2 * k) * np.sin(2.0 * np.pi * t / 4.0)
        q = 0.01 * np.cumsum(w)
        trials.append({"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque(t, q, w)})
    return pd.concat([pd.DataFrame(trial) for trial in trials], ignore_index=True)


@pytest.fixture(scope="session")
def slipping(tmp_path_factory: pytest.TempPathFactory) -> JointFit:
    """A contact that bends without creep and then slides: LuGre's bristle alone cannot be that."""
    rng = np.random.default_rng(1)
    t = 0.01 * np.arange(1200)
    trials = []
    for k, stroke in enumerate((0.6, 0.4, 0.25, 0.15)):
        q = stroke * np.sin(0.8 * (1.0 + 0.2 * k) * t)
        stretch, bent = 0.0, []
        for way in np.diff(q, prepend=q[0]):
            stretch = float(np.clip(stretch + way / REACH, -1.0, 1.0))
            bent.append(stretch)
        torque = LEVEL * np.array(bent) + 0.02 * np.gradient(q, t) + 0.0003 * rng.normal(size=len(t))
        trials.append(pd.DataFrame({"trial": k, "time_s": t, "position_rad": q, "torque_nm": torque}))
    path = tmp_path_factory.mktemp("slipping") / "log.csv"
    pd.concat(trials).to_csv(path, index=False)
    fit = base_of_rows(record([Log.read(path)]), "lugre", "auto").fits[0]
    return fit
