"""A pendulum that swings by its own weight tells neither weight nor inertia nor friction; that is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool import Log
from idtool.api.identify import identify
from idtool.fit.own_swing import swings_by_itself
from idtool.model.motion import Array
from idtool.signals import record

#: Of the pendulum: kg m^2, N m, N m, N m s/rad.
INERTIA, WEIGHT, COULOMB, VISCOUS = 0.28, 3.2, 0.06, 0.02
STEP = 0.005
Drive = Callable[[float, float, float], float]


def pump(torque: float) -> Drive:
    """What swings it up: along the motion."""
    return lambda t, q, w: torque * float(np.sign(w) or 1.0)


def lead(t: float, q: float, w: float) -> float:
    """After a motion of several frequencies."""
    goal = 0.8 * np.sin(0.9 * t) + 0.5 * np.sin(2.3 * t)
    speed = 0.72 * np.cos(0.9 * t) + 1.15 * np.cos(2.3 * t)
    return float(80.0 * (goal - q) + 6.0 * (speed - w))


def swing(folder: Path, drive: Drive, seconds: float) -> Log:
    """As a drive reads it: in coarse steps, with noise."""
    rng = np.random.default_rng(3)
    t, q, w, rows = 0.0, 0.0, 0.0, list[tuple[float, float, float]]()
    while t < seconds:
        torque = drive(t, q, w)
        rows.append((t, 0.003 * round(q / 0.003), torque + 0.02 * rng.normal()))
        for _ in range(20):
            friction = COULOMB * np.tanh(w / 0.01) + VISCOUS * w
            w += STEP / 20.0 * (torque - WEIGHT * np.sin(q) - friction) / INERTIA
            q += STEP / 20.0 * w
        t += STEP
    path = folder / "log.csv"
    table: Array = np.array(rows)
    pd.DataFrame(table, columns=["time_s", "position_rad", "torque_nm"]).to_csv(path, index=False)
    return Log.read(path)


@pytest.mark.parametrize(("torque", "seconds"), [(0.3, 12.0), (0.6, 8.0), (0.9, 5.0)])
def test_what_swings_by_itself_determines_nothing(tmp_path: Path, torque: float, seconds: float) -> None:
    log = swing(tmp_path, pump(torque), seconds)
    assert swings_by_itself(record([log]))
    result = identify([log])
    assert not any(p.identified for p in result.parameters.static.values())
    assert not result.parameters.weightless
    inertia = result.parameters.effect("inertia")
    assert inertia is not None
    assert not inertia.parameters["inertia"].identified
    assert inertia.parameters["inertia"].at_most is None
    assert any("may be of any size" in note for note in result.notes)


def test_what_is_led_determines_all_of_it(tmp_path: Path) -> None:
    log = swing(tmp_path, lead, 30.0)
    assert not swings_by_itself(record([log]))
    result = identify([log])
    assert result.parameters.gravity["sin"].value == pytest.approx(WEIGHT, rel=0.05)
    assert not any("may be of any size" in note for note in result.notes)
