"""What a fit keeps of what was computed of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Axis, Log
from idtool.fit.joint import JointFit, kept
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows


def small(path: Path) -> JointFit:
    t = 0.01 * np.arange(600)
    w = np.sin(t)
    frame = pd.DataFrame({"time_s": t, "position_rad": -np.cos(t), "torque_nm": np.sign(w) + 0.2 * w})
    frame.to_csv(path, index=False)
    found = base_of_rows(record([Log.read(path)]), "coulomb", "none").fits[0]
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


def test_a_known_resistance_takes_nothing_but_viscous_friction_from_the_fit() -> None:
    """... though the speed is read 30 ms late: the back-EMF is of the true speed."""
    t = 0.01 * np.arange(1500)
    q, w, a = (np.sin(0.5 * t**1.3 + k * np.pi / 2) for k in (0, 1, 2))
    rate = 0.65 * t**0.3
    w, a = rate * w, rate**2 * a
    volts = 4.0 * (0.1 * np.sign(w) + 0.35 * w + 0.02 * a)  # 0.3 of the 0.35 is back-EMF
    noise = np.random.default_rng(0).normal(0.0, 0.02, len(t))
    late = np.interp(t - 0.03, t, q)
    rows = {"trial": 0, "time_s": t, "position_rad": late, "supply_voltage_v": 12.0}
    frame = pd.DataFrame(rows | {"duty": (volts + noise) / 12.0})
    fits = []
    for resistance in (None, 4.8):
        axis = Axis(torque_per_volt=0.25, resistance=resistance)
        found = base_of_rows(record([Log(frame, axis)]), "coulomb", "none").fits[0]
        fits.append(found)
    whole, split = fits
    assert split.sse == pytest.approx(whole.sse, rel=1e-6)
    assert whole.values["viscous"] - split.values["viscous"] == pytest.approx(0.3, rel=1e-6)
    for name in ("coulomb", "inertia.inertia"):
        assert split.values[name] == pytest.approx(whole.values[name], rel=1e-5)
