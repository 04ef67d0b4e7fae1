"""Every hand on every day of a machine: the file is fitted once, the days differ from it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from idtool.control.admittance.tuning import tune, tuned
from idtool.errors import InputError
from idtool.parameters import Parameters
from testbench.guided_machines.figures import SCENARIOS, Figures, alone
from testbench.guided_machines.hands import PERIOD, SPEED, Arm
from testbench.guided_machines.machines import Machine, file_of, on_a_day, random_machine
from testbench.guided_machines.session import session

#: What `tune` is asked for, N: what it gives is the middle of what a hand feels on other days.
FORCE = 1.9
PAYLOAD_OFF = 0.02
SEED = 1


@dataclass(frozen=True)
class Axis:
    """One machine on one day.

    Attributes:
        name: of the machine, and which day.
        asked: force for which `tune` gave the gain, N.
        arm: of the leading hands.
        figures: of every scenario.
    """

    name: str
    asked: float
    arm: Arm
    figures: dict[str, Figures]


def tuned_file(file: Parameters, ratio: float) -> tuple[Parameters, float]:
    """The file with the gain of `tune` for FORCE, or for the least force above it that has the margins."""
    force = FORCE
    while True:
        try:
            return tuned(file, tune(file, force=force, speed=SPEED, ratio=ratio, period=PERIOD)), force
        except InputError:
            force = round(force + 0.05, 2)


def axis_of(machine: Machine, file: Parameters, asked: float, day: int) -> Axis:
    """Every hand on one day of a machine."""
    rng = np.random.default_rng([SEED, int(machine.name.split("-")[1]), day])
    p = on_a_day(rng, machine, PAYLOAD_OFF)
    stiffness = float(np.exp(rng.uniform(np.log(200.0), np.log(2000.0))))
    arm = Arm(stiffness, 10.0 * (stiffness / 200.0) ** 0.6)
    found = {}
    for name, (script, judge, start) in SCENARIOS.items():
        run = session(file, p, script(arm), int(rng.integers(1 << 31)), start)
        found[name] = judge(run, arm) | (alone(run) if name != "loading" else {})
    found["all"] = everywhere(list(found.values()))
    return Axis(f"{machine.name}, day {day}", asked, arm, found)


def everywhere(scenes: list[Figures]) -> Figures:
    """Starts without a hand in all scenes, and the most that the axis moved alone in one of them, mm."""
    return {
        "starts": sum(figures.get("starts", 0.0) for figures in scenes),
        "crept": max(figures.get("crept", 0.0) for figures in scenes),
    }


def machine_axes(number: int, days: int, cache: Path) -> list[Axis]:
    """Every day of the machine of that number."""
    rng = np.random.default_rng(SEED)
    machine = [random_machine(rng, k) for k in range(number + 1)][number]
    file, asked = tuned_file(file_of(machine, 0, cache), machine.plant.ratio)
    return [axis_of(machine, file, asked, day) for day in range(days)]
