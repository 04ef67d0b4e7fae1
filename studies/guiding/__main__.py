"""Study of hand guiding: `make study-teach` writes docs/teach.md.

Machines are drawn, a session is recorded on each, a file is fitted to it, and `tune` gives its gain for 1.9 N
at 19.2 mm/s. Then each machine has several days: friction off by up to 30 %, the payload by up to 0.02 kg,
another hand. On every day every hand comes.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from idtool.control.admittance.tuning import tune, tuned
from idtool.errors import InputError
from idtool.parameters import Parameters
from studies.guiding.figures import SCENARIOS, Figures, alone
from studies.guiding.hands import PERIOD, SPEED, Arm
from studies.guiding.machines import Machine, file_of, on_a_day, random_machine
from studies.guiding.session import session

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


@click.command()
@click.option(
    "--axes", default=600, show_default=True, help="How many, on as many days each as machines need."
)
@click.option("--machines", default=40, show_default=True, help="How many; each is identified once.")
@click.option("--out", type=click.Path(path_type=Path), default=Path("docs/teach.md"), show_default=True)
@click.option(
    "--cache", type=click.Path(path_type=Path), default=Path("build/guiding"), show_default=True,
    help="Where the identified files are kept.",
)  # fmt: skip
@click.option("--processes", default=os.cpu_count() or 1, show_default=True)
def main(axes: int, machines: int, out: Path, cache: Path, processes: int) -> None:
    """Run the study and write its page."""
    from studies.guiding import page

    days = -(-axes // machines)
    found: list[Axis] = []
    with ProcessPoolExecutor(processes) as pool:
        jobs = [pool.submit(machine_axes, number, days, cache) for number in range(machines)]
        for job in jobs:
            found += job.result()
            click.echo(f"{len(found)} axes", err=True)
    found = found[:axes]
    click.echo("\n".join(page.table(found)))
    out.write_text(page.page(found, out.parent / "images"), encoding="utf-8")


__all__ = ["Axis", "axis_of", "machine_axes", "tuned_file"]

if __name__ == "__main__":
    main()
