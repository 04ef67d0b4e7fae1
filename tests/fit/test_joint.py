"""What a fit keeps of what was computed of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from idtool import Log
from idtool.fit.joint import JointFit, kept
from idtool.signals import record
from idtool.verbs.identify import begin


def small(path: Path) -> JointFit:
    t = 0.01 * np.arange(600)
    w = np.sin(t)
    frame = pd.DataFrame({"time_s": t, "position_rad": -np.cos(t), "torque_nm": np.sign(w) + 0.2 * w})
    frame.to_csv(path, index=False)
    (found, *_), *_ = begin(record([Log.read(path)]), "coulomb", "none")
    return found


def test_it_is_computed_once_for_each_fit_and_each_argument(tmp_path: Path) -> None:
    asked: list[tuple[int, float]] = []

    @kept
    def scaled(fit: JointFit, factor: float, *, plus: float = 0.0) -> float:
        asked.append((id(fit), factor))
        return factor * fit.sse + plus

    one = small(tmp_path / "log.csv")
    other = replace(one)
    assert scaled(one, 2.0) == scaled(one, 2.0) == 2.0 * one.sse
    assert scaled(one, 3.0) == 3.0 * one.sse
    assert scaled(one, 2.0, plus=1.0) == 2.0 * one.sse + 1.0
    assert scaled(other, 2.0) == 2.0 * other.sse
    assert asked == [(id(one), 2.0), (id(one), 3.0), (id(one), 2.0), (id(other), 2.0)]
