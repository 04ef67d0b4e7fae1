"""How a refit with an effect begins."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.diagnosis import candidates
from idtool.diagnosis.candidates import Start, try_effect
from idtool.effects import registry
from idtool.fit.joint import JointFit
from idtool.signals import record
from idtool.verbs.identify import begin


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
    (fit, *_), *_ = begin(record([Log.read(path)]), "lugre", "auto")
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
