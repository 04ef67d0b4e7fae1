"""Hand guiding by the voltage of a hobby servo, over many simulated axes: docs/volts.md.

python -m studies.volts [axes]          make study-volts

Each axis is a `sim:sts3215` (backlash of one degree, readings 20 ms late, speeds in steps of 50 counts a
second, no current) whose friction, load and inertia differ from those of the axis that was identified. A
hand pulls ever harder until the axis follows, lets go, and leaves it alone.
"""

from __future__ import annotations

import math
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np

from idtool import identify
from idtool.control.force_free import ForceFreeController
from idtool.experiment.recipe import read_recipe
from idtool.fit.known_load import calibrate
from idtool.guiding.session import limits_of
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import Parameters
from idtool.parameters.scaling import in_torque
from idtool.rig.base import TrialSetup
from idtool.rig.opening import read_plant
from idtool.rig.plant_file import PlantFile
from idtool.rig.simulated import SimulatedRig
from pages import markdown
from testbench.plants import SESSION, recorded

AXES = 300
#: Standard deviations of what differs from the file, relative.
FRICTION, LOAD, INERTIA = 0.10, 0.02, 0.10
FLAT = TrialSetup(tilt_alpha_rad=math.pi / 2)
UPRIGHT = TrialSetup(payload_kg=0.3)
#: The hand pulls harder by this, N m/s; the axis follows once it has gone so far, rad, and stands when it is
#: slower than this, rad/s.
RAMP, FOLLOWS, STILL = 0.01, 0.03, 0.01
#: An axis that nobody touches has started once it has gone so far, rad.
STARTED = 2 * 2.0 * math.pi / 4096
LEFT_ALONE_S, TARE_S = 10.0, 6.0
#: Then it pulls so much harder for half a second before it lets go.
PULL = 1.5
#: Aims: of the force, and of the time to stand.
SHARE, STOP_S = 0.30, 0.100

_HEAD = (
    *("", "share, median", "95 % below", "within 30 %"),
    *("let go at", "stop, 95 % below", "in 100 ms", "started", "faults"),
)


@dataclass(frozen=True)
class Guided:
    """One axis.

    Attributes:
        share: torque that starts it over that of the axis without power.
        speed: at which it is let go, rad/s.
        stop_s: from letting go to standing; NaN where it never followed.
        crept: how far it went while nobody touched it, rad.
        faults: what the controller stopped for.
    """

    share: float
    speed: float
    stop_s: float
    crept: float
    faults: str


def identified(plant: PlantFile) -> Parameters:
    """The file that a session of the axis gives: the packaged experiments, a weight on a known lever for the
    torque per volt, `identify`."""
    logs = recorded(SimulatedRig(plant, seed=0), map(read_recipe, SESSION))
    lever = plant.gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY
    found = calibrate(logs[:1], lever=lever)
    return in_torque(identify(logs).parameters, found.constant, found.unit)


def real(plant: PlantFile, rng: np.random.Generator) -> PlantFile:
    """An axis that differs from its file."""
    more = {name: float(np.exp(FRICTION * rng.standard_normal())) for name in ("level", "viscous")}
    friction = dict(plant.friction)
    for name in ("coulomb_nm", "static_nm"):
        friction[name] *= more["level"]
    friction["viscous_nm_s_per_rad"] *= more["viscous"]
    gravity = {
        name: value * float(1.0 + LOAD * rng.standard_normal()) for name, value in plant.gravity.items()
    }
    inertia = plant.inertia * float(np.exp(INERTIA * rng.standard_normal()))
    return replace(plant, friction=friction, gravity=gravity, inertia=inertia)


def guide(plant: PlantFile, parameters: Parameters, setup: TrialSetup, seed: int) -> Guided:
    """Left alone, pulled, and let go."""
    rig = SimulatedRig(plant, seed=seed)
    rig.prepare(setup)
    controller = ForceFreeController(parameters, 0.01, mode="light", limits=limits_of(rig))
    position, asked = 0.0, False
    sample = rig.step(position)

    def step(hand: float) -> None:
        nonlocal sample, position
        position = controller.step(
            sample.position,
            sample.velocity,
            sample.effort,
            setup.payload_kg,
            setup.tilt_alpha_rad,
            setup.tilt_beta_rad,
            time_s=sample.time_s,
        )
        sample = rig.step(position, hand)

    for _ in range(round(TARE_S / rig.period_s)):
        step(0.0)
        asked = asked or (controller.ready and controller.tare())
    begun = float(rig._state[0])
    for _ in range(round(LEFT_ALONE_S / rig.period_s)):
        step(0.0)
    crept = abs(float(rig._state[0]) - begun)
    start, hand = float(rig._state[0]), 0.0
    while abs(float(rig._state[0]) - start) < FOLLOWS and hand < 2.0 * plant.friction["static_nm"]:
        hand += RAMP * rig.period_s
        step(hand)
    followed = abs(float(rig._state[0]) - start) >= FOLLOWS
    for _ in range(50 if followed else 0):
        step(PULL * hand)
    speed, moved = abs(float(rig._state[1])), 0
    for k in range(100 if followed else 0):
        step(0.0)
        if abs(float(rig._state[1])) >= STILL:
            moved = k + 1
    stop = moved * rig.period_s if followed else math.nan
    fault = controller.status.fault
    share = hand / plant.friction["static_nm"]
    return Guided(share if followed else math.inf, speed, stop, crept, fault.message if fault else "")


def main(axes: int = AXES) -> None:
    """Write the page."""
    plant = read_plant("sts3215")
    parameters = identified(plant)
    rows = []
    for name, setup in (("on its side", FLAT), ("upright with 0.3 kg", UPRIGHT)):
        rng = np.random.default_rng(0)
        drawn = [real(plant, rng) for _ in range(axes)]
        with ProcessPoolExecutor() as pool:
            found = list(pool.map(guide, drawn, repeat(parameters), repeat(setup), range(axes)))
        share = np.array([one.share for one in found])
        stop = np.array([one.stop_s for one in found])
        crept = np.array([one.crept for one in found])
        cells = [
            f"{100 * np.median(share):.0f} %",
            f"{100 * np.quantile(share, 0.95):.0f} %",
            f"{np.sum(share <= SHARE)}",
            f"{np.median([one.speed for one in found]):.2f} rad/s",
            f"{1e3 * np.nanquantile(stop, 0.95):.0f} ms",
            f"{np.sum(stop <= STOP_S)}",
            f"{np.sum(crept > STARTED)}",
            f"{sum(bool(one.faults) for one in found)}",
        ]
        rows.append((name, *cells))
        print(*rows[-1], flush=True)
    effects = ", ".join(entry.name for entry in parameters.effects)
    made = [f"{axes} axes; the file holds {effects}.", "", *markdown.table(_HEAD, rows)]
    markdown.write_made("docs/volts.md", {"axes": made}, "study-volts")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
