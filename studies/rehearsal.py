"""The whole session on virtual servos, behind their vendors' SDKs: docs/rehearsal.md.

python -m studies.rehearsal          make study-rehearsal

Recipes as they come, a weight for the constant, identification, forward simulation, hand guiding and playing
back. The truth of the axis is the plant's; nothing of it is read before the end.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import dynamixel_sdk
import numpy as np
import scservo_sdk

from idtool import identify
from idtool.control.force_free import ForceFreeController
from idtool.errors import RigFault
from idtool.experiment.recipe import parse_recipe
from idtool.experiment.runner import run
from idtool.fit.known_load import calibrate
from idtool.guiding.path import limited, read_path
from idtool.guiding.playback import play
from idtool.guiding.session import limits_of, teach
from idtool.log import Log
from idtool.model.units import STANDARD_GRAVITY
from idtool.parameters import Parameters
from idtool.parameters.scaling import in_torque
from idtool.rig.base import TrialSetup
from idtool.rig.opening import read_plant
from idtool.verbs.simulate import simulate
from pages import markdown
from testbench.bench import SHORT_SESSION, Bench

FLAT = TrialSetup(tilt_alpha_rad=math.pi / 2)
#: The SDKs give an answer up after some 40 ms of this computer, which may be busy elsewhere; here after so
#: much more.
_PATIENCE = 50.0
_TRIES = 6
#: The hand pushes so much, N m, one way and back.
PUSH = 0.12


@dataclass(frozen=True)
class Session:
    """One servo: kind and model, the plant behind it, options of the rig."""

    title: str
    kind: str
    plant: str
    model: int
    options: dict[str, float]


SESSIONS = (
    Session("DYNAMIXEL XH540-V150", "dynamixel", "bench", 1150, {"period": 0.01}),
    Session("DYNAMIXEL XL330-M288", "dynamixel", "bench", 1200, {"period": 0.01}),
    Session("Feetech STS3215", "feetech", "sts3215", 777, {"period": 0.01, "speed": 2.0}),
)
STEPS = (
    "recipes",
    "`calibrate gravity.csv --lever`",
    "true constant",
    "`identify`",
    "Coulomb level, true",
    "stiction, true",
    "`simulate sine.csv`",
    "`teach`",
    "`play --speed 0.5`",
)


def rehearse(session: Session, folder: Path) -> dict[str, str]:
    """What a person would do, and what came of it: step and result."""
    with Bench(plant=session.plant, kind=session.kind, model=session.model) as on:
        logs, seconds = [], 0.0
        for name in ("gravity", "sweep", "sine"):
            path = folder / f"{name}.csv"
            with on.rig(**session.options) as rig:
                seconds += run(
                    parse_recipe(SHORT_SESSION[name], name), rig, path, confirm=on.setup
                ).duration_s
            logs.append(Log.read(path))
        said = {"recipes": f"{seconds:.0f} s of motion"}
        file = read_plant(session.plant)
        found = calibrate(logs[:1], lever=file.gravity["per_payload_nm_per_kg"] / STANDARD_GRAVITY)
        truth = file.axis.torque_constant
        assert truth is not None
        by_current = found.unit == "current"
        unit = "N m/A" if by_current else "N m/V"
        low, high = found.constant.ci95 or (math.nan, math.nan)
        said[STEPS[1]] = f"{found.constant.value:.4g} {unit}, 95 % {low:.4g} to {high:.4g}"
        said[STEPS[2]] = f"{truth if by_current else truth / file.motor.resistance:.4g} {unit}"
        result = identify(logs, seed=0)
        parameters = in_torque(result.parameters, found.constant, found.unit)
        effects = ", ".join(entry.name for entry in parameters.effects if entry.name != "inertia")
        said[STEPS[3]] = f"{result.diagnosis['verdict']}: {effects or 'no effect'}"
        for step, name in zip(STEPS[4:6], ("coulomb", "static"), strict=True):
            true = file.friction[f"{name}_nm"]
            said[step] = f"{parameters.static[name].value:.4g}, {true:.4g} N m"
        told = replace(logs[2], axis=parameters.axis)
        said[STEPS[6]] = f"{1e3 * simulate(told, parameters).rms_windows:.2f} mrad rms over 1 s windows"
        return said | _guide(on, session, parameters, folder)


def _guide(on: Bench, session: Session, parameters: Parameters, folder: Path) -> dict[str, str]:
    """A hand pushes one way and back; then the path is played."""

    def push(share: float) -> None:
        time = 8.0 * share
        on.servo.axis.hand_nm = PUSH if 1.0 <= time < 3.0 else -PUSH if 4.0 <= time < 6.0 else 0.0

    on.servo.axis.load(FLAT)
    taught = folder / "taught.csv"
    with on.rig(**session.options) as rig:
        controller = ForceFreeController(parameters, 0.01, limits=replace(limits_of(rig), gap_periods=50.0))
        record = teach(parameters, controller, rig, FLAT, duration_s=8.0, log=taught, progress=push).record
    turn = int(np.searchsorted(record.time, 3.5))
    there, back = np.ptp(record.position[:turn]), np.ptp(record.position[turn:])
    still = float(np.ptp(record.position[int(np.searchsorted(record.time, 7.0)) :]))
    with on.rig(**session.options) as rig:
        low, high = rig.limits.position
        path, _ = limited(read_path(taught)[0], low=low, high=high, speed=1.0, acceleration=4.0, scale=0.5)
        played = play(path, rig, FLAT, behind=0.3)
    moved = f"{PUSH} N m: {there:.2f} rad there, {back:.2f} back; {1e3 * still:.1f} mrad in the last second"
    stopped = "" if played.stopped is None else f", stopped: {played.stopped.why}"
    return {STEPS[7]: moved, STEPS[8]: f"{1e3 * played.rms_error:.1f} mrad rms along the path{stopped}"}


def _be_patient() -> None:
    """Let both SDKs wait longer for an answer: the time of a rehearsal is not the computer's."""

    def over(port: Any) -> bool:
        return bool(port.getTimeSinceStart() > _PATIENCE * port.packet_timeout)

    for sdk in (dynamixel_sdk, scservo_sdk):
        sdk.PortHandler.isPacketTimeout = over


def _patiently(session: Session) -> dict[str, str]:
    """A session, begun anew where this computer was too busy for the bus."""
    for _ in range(_TRIES):
        with tempfile.TemporaryDirectory() as name:
            try:
                return rehearse(session, Path(name))
            except RigFault as fault:
                print(fault, flush=True)
    raise RuntimeError("this computer is too busy for a bus")


def main() -> None:
    """Write the page."""
    _be_patient()
    columns = []
    for session in SESSIONS:
        columns.append(_patiently(session))
        print(session.title, columns[-1], flush=True)
    head = ("", *(session.title for session in SESSIONS))
    rows = ((step, *(column[step] for column in columns)) for step in STEPS)
    markdown.write_made("docs/rehearsal.md", {"sessions": markdown.table(head, rows)}, "study-rehearsal")


if __name__ == "__main__":
    main()
