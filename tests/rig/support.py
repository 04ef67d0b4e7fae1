"""Shared by the rig's tests: plants from numbers, recorded trials, and the plain formulas."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from idtool.rig.base import Rig, Trajectory, TrialSetup
from idtool.rig.plant_file import parse_plant
from idtool.rig.simulated import SimulatedRig

K = 2.67
FLAT = math.pi / 2  # lying on its side: gravity does not act
BENCH: dict[str, Any] = {
    "description": "test axis",
    "sensors": "ideal",
    "axis": {"kind": "rotary", "torque_constant_nm_per_a": K},
    "plant": {"inertia_kg_m2": 0.008},
    "gravity": {"kind": "slide", "base_nm": 0.20, "per_payload_nm_per_kg": 0.42},
    "friction": {
        "coulomb_nm": 0.080,
        "static_nm": 0.115,
        "stribeck_velocity_rad_s": 0.08,
        "viscous_nm_s_per_rad": 0.12,
        "bristle_stiffness_nm_per_rad": 8.0,
        "bristle_damping_nm_s_per_rad": 0.2,
    },
    "limits": {"lowest_rad": -2.5, "highest_rad": 2.5, "speed_rad_s": 2.0, "current_a": 1.5},
}


def table(**changes: Any) -> dict[str, Any]:
    """The bench with other numbers: `friction={...}` updates that table, a plain value replaces."""
    result = copy.deepcopy(BENCH)
    for key, value in changes.items():
        if isinstance(value, dict) and isinstance(result.get(key), dict):
            result[key] |= value
        else:
            result[key] = value
    return result


def rig_of(*effects: dict[str, Any], seed: int = 0, **changes: Any) -> SimulatedRig:
    """A rig with these effects, with the truth for readings unless `sensors` says otherwise."""
    return SimulatedRig(parse_plant(table(effects=list(effects), **changes), Path("test.toml")), seed=seed)


def play(
    rig: Rig, command: NDArray[np.float64], setup: TrialSetup, mode: Any = "velocity"
) -> NDArray[np.float64]:
    """Time, position, velocity and torque K i of one trial, shape (4, samples)."""
    rig.prepare(setup)
    return record(rig, command, mode)


def record(rig: Rig, command: NDArray[np.float64], mode: Any = "velocity") -> NDArray[np.float64]:
    """As `play`, from where the axis stands."""
    blocks = list(rig.play(Trajectory(rig.period_s, mode, command)))
    names = ("time_s", "position", "velocity", "current")
    data = np.array([np.concatenate([getattr(block, name) for block in blocks]) for name in names])
    data[3] *= K
    return data


def steady(rig: Rig, speed: float, setup: TrialSetup, seconds: float = 3.0) -> NDArray[np.float64]:
    """The last tenth of a second of a run at constant speed."""
    return play(rig, np.full(round(seconds / rig.period_s), speed), setup)[:, -20:]


def curve(w: float) -> float:
    """Steady friction of the test axis, N m."""
    f = BENCH["friction"]
    g: float = f["coulomb_nm"] + (f["static_nm"] - f["coulomb_nm"]) * math.exp(
        -((w / f["stribeck_velocity_rad_s"]) ** 2)
    )
    viscous: float = f["viscous_nm_s_per_rad"]
    return math.copysign(g, w) + viscous * w
