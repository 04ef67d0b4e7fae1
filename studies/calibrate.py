"""How often the interval of a calibrated torque constant holds the truth.

python -m studies.calibrate [--axes 200]        (make study-calibrate, some minutes): docs/calibration.md

Axes are drawn at random and simulated; every log declares a torque constant that is 50 % off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import click
import numpy as np

from idtool import Axis, Log
from idtool.errors import FfcIdError
from idtool.fit.known_load import Calibration, calibrate
from idtool.model.units import STANDARD_GRAVITY
from pages import markdown
from testbench.pendulums import Pendulum

PAGE = "docs/calibration.md"
#: What is counted: off by less than this.
WITHIN = 0.02
#: Length of a log, s.
SECONDS = 12.0
#: The constant that the logs declare, over the true one.
DECLARED = 1.5


def drawn(seed: int) -> Pendulum:
    """An axis: friction from a twentieth to a third of the load, its own weight up to a third of it."""
    random = np.random.default_rng(seed)
    mass, lever = random.uniform(0.2, 1.5), random.uniform(0.05, 0.25)
    load = STANDARD_GRAVITY * mass * lever
    return Pendulum(
        inertia=mass * lever**2 * random.uniform(1.2, 3.0),
        mass=mass,
        lever=lever,
        own=load * random.uniform(-0.3, 0.3),
        coulomb=load * random.uniform(0.05, 0.33),
        viscous=load * random.uniform(0.02, 0.1),
        torque_constant=random.uniform(0.3, 3.0),
    )


def alone(axis: Pendulum, seed: int) -> Calibration:
    """One swing, in which all the gravity is the load's."""
    bare = replace(axis, own=0.0)
    return calibrate([_declared(bare, seed)], lever=axis.lever, mass=axis.mass)


def pair(axis: Pendulum, seed: int) -> Calibration:
    """With and without the load: the axis' own weight need not be known (Gautier & Briot 2014)."""
    logs = [_declared(axis, seed, axis.mass), _declared(axis, seed + 10_000, 0.0)]
    return calibrate(logs, lever=axis.lever)


def unknown(axis: Pendulum, seed: int) -> Calibration:
    """The same two sessions with the axis' own weight taken for the load's, as nobody should."""
    log = _declared(axis, seed)
    return calibrate([log], lever=axis.lever, mass=axis.mass)


VARIANTS: dict[str, Callable[[Pendulum, int], Calibration]] = {
    "one swing with the load, no weight of its own": alone,
    "two sessions, with and without the load": pair,
    "one session, own weight up to 30 % of the load taken for the load's": unknown,
}


def _declared(axis: Pendulum, seed: int, payload: float | None = None) -> Log:
    current = STANDARD_GRAVITY * axis.mass * axis.lever / axis.torque_constant
    return axis.log(
        seed=seed,
        seconds=SECONDS,
        payload=payload,
        noise=0.01 * current,
        axis=Axis(torque_constant=DECLARED * axis.torque_constant),
    )


def study(variant: Callable[[Pendulum, int], Calibration], axes: int) -> tuple[list[float], list[bool], int]:
    """Relative errors, whether the interval holds the truth, and how many were refused."""
    errors, holds, refused = [], [], 0
    for seed in range(axes):
        axis = drawn(seed)
        try:
            found = variant(axis, seed).constant
        except FfcIdError:
            refused += 1
            continue
        assert found.ci95 is not None
        errors.append(found.value / axis.torque_constant - 1.0)
        holds.append(found.ci95[0] <= axis.torque_constant <= found.ci95[1])
    return errors, holds, refused


def row(name: str, errors: list[float], holds: list[bool], refused: int) -> tuple[object, ...]:
    """Cells of one line of the page."""
    size = np.abs(errors)
    share = float(np.mean(holds))
    spread = 1.96 * math.sqrt(share * (1.0 - share) / len(size))
    return (
        name,
        len(size) + refused,
        f"{100 * float(np.mean(size < WITHIN)):.1f} %",
        f"{100 * float(np.median(size)):.2f} %",
        f"{100 * float(np.quantile(size, 0.95)):.2f} %",
        f"{100 * share:.1f} ± {100 * spread:.1f} %",
        refused,
    )


@click.command()
@click.option("--axes", type=click.IntRange(1), default=200, show_default=True)
def main(axes: int) -> None:
    """Write the page."""
    rows = [
        row(name, *study(variant, max(axes // 5, 1) if variant is unknown else axes))
        for name, variant in VARIANTS.items()
    ]
    head = ("load", "axes", f"within {100 * WITHIN:.0f} %", "median error", "95 % of errors below",
            "the interval holds the truth", "refused")  # fmt: skip
    markdown.write_made(PAGE, {"shares": markdown.table(head, rows)}, "study-calibrate")


if __name__ == "__main__":
    main()
