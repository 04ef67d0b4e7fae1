"""Short sessions of made-up axes, by the thousand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from idtool.fleet import Options
from idtool.log import Log
from idtool.parameters.axis import Axis

#: The quickest way to identify: Coulomb and viscous friction, inertia.
QUICK = Options(friction="coulomb", gravity="none")


def session(
    folder: Path,
    *,
    coulomb: float = 0.08,
    viscous: float = 0.12,
    seed: int = 0,
    unit: str = "",
    date: str = "",
) -> Path:
    """A folder with one log of six sines."""
    rng = np.random.default_rng(seed)
    trial, time = np.repeat(np.arange(6), 200), np.tile(np.arange(200) * 0.01, 6)
    speed, reach = 2 * np.pi * (0.4 + 0.2 * trial), 0.4 / (1 + 0.3 * trial)
    velocity = reach * speed * np.cos(speed * time)
    torque = coulomb * np.sign(velocity) + viscous * velocity - 0.01 * reach * speed**2 * np.sin(speed * time)
    frame = pd.DataFrame(
        {
            "trial": trial,
            "time_s": time,
            "position_rad": reach * np.sin(speed * time),
            "velocity_rad_s": velocity,
            "torque_nm": torque + 0.002 * rng.standard_normal(len(time)),
        }
    )
    folder.mkdir(parents=True)
    axis = Axis("rotary", extra={"unit": unit} if unit else {})
    header = {"date": date} if date else {}
    Log(frame, axis, "sine", header).write(folder / "sine.csv")
    return folder
