"""What an exported joint costs in position, beside the model that it was exported from: docs/exchange.md.

python -m studies.exchange          make study-exchange (needs the network once, for EMPS)

Each log is simulated from its effort over windows of one second, each from the measured state, as MuJoCo's
own identification judges a model: by `ffc-id simulate`, and by MuJoCo from the exported file. Only logs in
which gravity does not act take part, since a joint leaves gravity to the masses of its model.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco
import numpy as np

from idtool import identify
from idtool.experiment.recipe import read_recipe
from idtool.experiment.runner import run
from idtool.export.targets import export
from idtool.importing.recording import import_recording
from idtool.io.catalogue import fetch, read_catalogue
from idtool.log import Log
from idtool.parameters import Parameters
from idtool.rig import open_rig
from idtool.rig.opening import read_plant
from idtool.signals import record
from idtool.simulation.stage import WINDOW_S, measured_position, windows
from idtool.verbs.fit_motion import fit_motion
from idtool.verbs.predict import of_axis
from idtool.verbs.simulate import simulate
from pages import markdown

STEP_S = 2e-4
FLAT_RECIPES = ("sweep", "sine")
#: What is added to the bench: all that MuJoCo has a place for, and one thing that it has none for.
_ADDED = """
[[effects]]
name = "torque_offset"
offset_nm = 0.03
[[effects]]
name = "position_ripple"
cycles_per_turn = 12.0
amplitude_1_nm = 0.01
amplitude_2_nm = 0.005
"""
_ASYMMETRY = """
[[effects]]
name = "direction_asymmetry"
asymmetry_nm_s_per_rad = 0.03
"""
_HEAD = ("", "our own model", "MuJoCo, `dcmotor`", "MuJoCo, `--friction coulomb`")


def in_mujoco(text: str, logs: Sequence[Log], parameters: Parameters) -> float:
    """rms position over windows of one second, rad (m), of logs without gravity."""
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = STEP_S
    known = of_axis(logs, parameters)
    recording = record(known, every_row=True)
    motion, torque = recording.motion, recording.torque
    measured = measured_position(known, recording)
    top = float(np.max(np.abs(motion.velocity)))
    squares, rows = 0.0, 0
    for part in windows(motion.time, motion.starts.tolist(), WINDOW_S):
        data = mujoco.MjData(model)
        time = motion.time[part] - motion.time[part.start]
        velocity = float(motion.velocity[part.start])
        data.qpos[0] = motion.position[part.start]
        data.qvel[0] = velocity if abs(velocity) > 0.01 * top else 0.0
        if model.na:  # the bristle, settled where the axis moves, as `ffc-id simulate` begins
            data.act[0] = _bristle(parameters, float(data.qvel[0]))
        steps = math.ceil(float(time[-1]) / STEP_S) + 1
        given = np.interp(STEP_S * np.arange(steps), time, torque[part])
        path = np.empty(steps)
        for k in range(steps):
            path[k] = data.qpos[0]
            data.ctrl[0] = given[k]
            mujoco.mj_step(model, data)
        found = np.interp(time, STEP_S * np.arange(steps), path)
        squares += float(np.sum((found - measured[part]) ** 2))
        rows += len(time)
    return math.sqrt(squares / rows)


def _bristle(parameters: Parameters, velocity: float) -> float:
    """Its steady deflection at a speed, rad (m)."""
    values = {name: one.value for name, one in (parameters.static | parameters.dynamic).items()}
    if velocity == 0.0:
        return 0.0
    fade = math.exp(-((velocity / values["stribeck_velocity"]) ** 2))
    level = values["coulomb"] + (values["static"] - values["coulomb"]) * fade
    return math.copysign(level / values["bristle_stiffness"], velocity)


def on_bench(added: str, folder: Path) -> tuple[list[Log], Parameters]:
    """Logs of a bench with effects, and what is identified from all of them; the flat ones."""
    text = (Path(read_plant.__code__.co_filename).parent / "bench.toml").read_text(encoding="utf-8")
    (folder / "plant.toml").write_text(text + added, encoding="utf-8")
    logs = []
    for name in ("gravity", *FLAT_RECIPES):
        with open_rig(f"sim:{folder / 'plant.toml'}", seed=1) as rig:
            run(read_recipe(name), rig, folder / f"{name}.csv", force=True)
        logs.append(Log.read(folder / f"{name}.csv"))
    return logs[1:], identify(logs, seed=0).parameters


def emps_log(folder: Path) -> Log:
    """The public EMPS recording, made into a log as the catalogue says."""
    fetched = fetch(read_catalogue().get("emps"), folder, force=True)
    return import_recording(next(iter(fetched)), torque_constant=35.15).log


def main(emps: str | None = None) -> None:
    """Write the page; `emps` is a log of EMPS that is there already."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = emps_log(folder) if emps is None else Log.read(emps)
        cases: dict[str, Callable[[], tuple[list[Log], Parameters]]] = {
            "`sim:bench` (mrad)": lambda: on_bench("", folder),
            "... with an offset and a ripple of two waves (mrad)": lambda: on_bench(_ADDED, folder),
            "... and an asymmetry (mrad)": lambda: on_bench(_ADDED + _ASYMMETRY, folder),
            "EMPS (mm)": lambda: ([log], identify([log], seed=0).parameters),
            "EMPS, fitted to the motion (mm)": lambda: ([log], fit_motion([log]).parameters),
        }
        for title, make in cases.items():
            logs, parameters = make()
            figures = [simulate(logs, parameters).rms_windows]
            for friction in ("auto", "coulomb"):
                text = export("mujoco", parameters, logs, friction=friction).text
                figures.append(in_mujoco(text, logs, parameters))
            rows.append((title, *(f"{1e3 * value:.2f}" for value in figures)))
            print(*rows[-1], flush=True)
    markdown.write_made("docs/exchange.md", {"errors": markdown.table(_HEAD, rows)}, "study-exchange")


if __name__ == "__main__":
    main(*sys.argv[1:2])
