"""A virtual servo on a bench: in this process, on a clock that skips waits, behind the vendor's SDK."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from idtool.experiment.recipe import Recipe, parse_recipe
from idtool.parameters import Controller, Parameter, Parameters
from idtool.rig.base import TrialSetup
from idtool.rig.clock import SkippingClock
from idtool.rig.dynamixel.bus import Bus
from idtool.rig.dynamixel.rig import DynamixelRig
from idtool.rig.dynamixel.settings import Settings
from idtool.rig.opening import read_plant
from idtool.rig.virtual.axis import VirtualAxis
from idtool.rig.virtual.faults import Mishaps, parse_fault
from idtool.rig.virtual.servo import VirtualServo
from idtool.rig.virtual.table import FIELDS
from idtool.rig.virtual.terminal import VirtualTerminal

BAUD = 1_000_000
#: Lying on its side: without torque it stays where it is.
FLAT = TrialSetup(tilt_alpha_rad=np.pi / 2)
#: What a servo measures, and goals: they change with every motion.
MEASURED = {
    "goal_position", "goal_velocity", "realtime_tick", "present_current", "present_velocity",
    "present_position", "present_temperature",
}  # fmt: skip

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


class Bench:
    """A virtual servo and its surroundings."""

    def __init__(self, *faults: str, plant: str = "bench", model: int = 1150, seed: int = 0) -> None:
        self.clock = SkippingClock()
        self.servo = VirtualServo(
            VirtualAxis(read_plant(plant), seed=seed, setup=FLAT),
            model=model,
            baud=BAUD,
            now=self.clock.now(),
        )
        self.mishaps = Mishaps([parse_fault(word) for word in faults], seed=seed)
        self.terminal = VirtualTerminal(self.servo, mishaps=self.mishaps, clock=self.clock)

    def bus(self, **other: Any) -> Bus:
        return Bus(**({"device": self.terminal.path, "id": 1, "baud": BAUD, "clock": self.clock} | other))

    def rig(self, **settings: Any) -> DynamixelRig:
        return DynamixelRig(self.terminal.path, Settings(**({"baud": BAUD} | settings)), clock=self.clock)

    def setup(self, trial: int, trials: int, setup: TrialSetup, before: TrialSetup | None) -> None:
        """What a person does between trials."""
        with self.terminal.lock:
            self.servo.axis.load(setup)

    def table(self) -> dict[str, int]:
        """The control table without what a motion changes."""
        with self.terminal.lock:
            return {name: self.servo.table[name] for name in FIELDS if name not in MEASURED}

    def later(self, seconds: float) -> tuple[float, float]:
        """Position and speed of the axis after so long in which nobody says anything."""
        with self.terminal.lock:
            self.clock.wait_until(self.clock.now() + seconds)
            self.servo.pass_time(self.clock.now())
            return self.servo.axis.position, self.servo.axis.velocity

    def stands(self, seconds: float) -> bool:
        """Whether the axis stands after so long, and goes on standing."""
        first, speed = self.later(seconds)
        second, _ = self.later(1.0)
        return abs(speed) < 1e-2 and abs(second - first) < 2e-3


def eventually(true: Callable[[], bool]) -> bool:
    """Whether it becomes true within some seconds."""
    until = time.monotonic() + 5.0
    while not true() and time.monotonic() < until:
        time.sleep(0.001)
    return true()


@contextmanager
def bench(*faults: str, **options: Any) -> Iterator[Bench]:
    made = Bench(*faults, **options)
    try:
        yield made
    finally:
        made.terminal.close()


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


def sine(rig: DynamixelRig, seconds: float = 1.0, amplitude: float = 0.5) -> np.ndarray:
    """Speeds of one period, at the period of the rig."""
    time = np.arange(round(seconds / rig.period_s)) * rig.period_s
    return np.asarray(amplitude * np.sin(2 * np.pi * time / seconds))


def log_path(folder: Path) -> Path:
    return folder / "log.csv"
