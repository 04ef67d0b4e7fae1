"""What the tests of the DYNAMIXEL rig share."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from idtool.experiment.recipe import Recipe, parse_recipe
from idtool.parameters import Controller, Parameter, Parameters
from idtool.rig.bus.rig import ServoRig
from idtool.rig.opening import read_plant
from testbench.bench import BAUD, FLAT, Bench

__all__ = ["BAUD", "FLAT", "Bench"]

SWEEP = """
schema = "ffc-id/recipe/1"
name = "mine"
experiment = "sweep"
[setup]
tilt_alpha_rad = 1.5707963267948966
rest_s = 0.1
[[trials]]
kind = "back_and_forth"
payload_kg = [0.0, 0.5]
speed_rad_s = 0.5
travel_rad = 0.6
repeats = 1
"""


def recipe(text: str = SWEEP) -> Recipe:
    return parse_recipe(text, "mine.toml")


def eventually(true: Callable[[], bool]) -> bool:
    """Whether it becomes true within some seconds."""
    until = time.monotonic() + 5.0
    while not true() and time.monotonic() < until:
        time.sleep(0.001)
    return true()


def parameters_of(plant: str) -> Parameters:
    """What a perfect identification of a named plant would write."""
    file = read_plant(plant)

    def pick(table: dict[str, float], *names: str) -> dict[str, Parameter]:
        short = {key.rsplit("_nm", 1)[0].removesuffix("_rad_s"): value for key, value in table.items()}
        return {name: Parameter(short[name]) for name in names}

    return Parameters(
        axis=file.axis,
        gravity_model="slide",
        gravity=pick(file.gravity, "base", "per_payload"),
        static=pick(file.friction, "coulomb", "static", "stribeck_velocity", "viscous"),
        dynamic=pick(file.friction, "bristle_stiffness", "bristle_damping"),
        controller=Controller(2.05, 1.68, 0.01),
    )


def sine(rig: ServoRig, seconds: float = 1.0, amplitude: float = 0.5) -> np.ndarray:
    """Speeds of one period, at the period of the rig."""
    time = np.arange(round(seconds / rig.period_s)) * rig.period_s
    return np.asarray(amplitude * np.sin(2 * np.pi * time / seconds))


def log_path(folder: Path) -> Path:
    return folder / "log.csv"
