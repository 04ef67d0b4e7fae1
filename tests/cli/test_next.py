"""Every command that computes ends with the one command to go on with."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from idtool.cli.commands import ffc_id as program

from idtool import Axis, Log, Parameters
from idtool.parameters import EffectEntry, Parameter
from testbench.pendulums import Pendulum

from .support import ffc_id

COULOMB = ("--friction", "coulomb", "--gravity", "none")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A parameter file, a log of that axis, one whose current is inverted, and a swinging load."""
    folder = tmp_path_factory.mktemp("next")
    axis = Axis("rotary", 2.5)
    values = {"coulomb": 0.08, "static": 0.1, "stribeck_velocity": 0.1, "viscous": 0.12}
    static = {name: Parameter(value) for name, value in values.items()}
    arm = {name: Parameter(0.0) for name in ("sin", "cos")}
    inertia = EffectEntry("inertia", {"inertia": Parameter(0.04)})
    known = Parameters(axis=axis, gravity_model="arm", gravity=arm, static=static, effects=(inertia,))
    known.write(folder / "params.toml")
    time = np.arange(4000) * 0.01
    speed = 0.5 * np.sin(time)
    noise = 0.002 * np.random.default_rng(0).standard_normal(len(time))
    torque = 0.09 * np.tanh(speed / 0.01) + 0.12 * speed + 0.02 * np.cos(time) + noise
    frame = pd.DataFrame(
        {"trial": 0, "time_s": time, "position_rad": -0.5 * np.cos(time), "current_a": torque / 2.5}
    )
    Log(frame, axis, "sine").write(folder / "sine.csv")
    Log(frame.assign(current_a=-frame["current_a"]), axis, "sine").write(folder / "inverted.csv")
    Pendulum().log().write(folder / "swing.csv")
    return folder


def last(*words: str, cwd: Path) -> list[str]:
    """The command that a command ends with."""
    done = ffc_id(*words, cwd=cwd)
    assert done.returncode == 0, done.stderr
    line = done.stderr.splitlines()[-1]
    assert done.stderr.count("next: ") == 1
    assert line.startswith("next: ffc-id ")
    following = shlex.split(line.removeprefix("next: ffc-id "))
    assert following[0] in program.list_commands(None)  # type: ignore[arg-type]
    return following


@pytest.mark.parametrize(
    ("words", "following"),
    [
        ("rigs", "run-sweep --rig sim:paper"),
        ("recipes", "run --recipe sweep --rig sim:paper"),
        ("data list", "data get sample"),
        ("predict sine.csv -p params.toml -o a.csv", "tune -p params.toml"),
        ("simulate sine.csv -p params.toml -o b.csv", "fit-motion LOG..."),
        ("compare params.toml params.toml", "compare params.toml params.toml LOG..."),
        ("compare params.toml params.toml sine.csv", "fleet"),
        ("calibrate swing.csv --mass 0.5 --lever 0.1", "identify LOG... --torque-constant"),
        ("export json -p params.toml -o axis.json", "tune -p params.toml"),
        ("export urdf -p params.toml -o axis.urdf", "export urdf -p params.toml -o axis.urdf --force LOG..."),
        ("export c -p params.toml -o board --any-position", "teach -p params.toml"),
        (f"identify inverted.csv -o wrong {' '.join(COULOMB)}", "plot inverted.csv"),
    ],
)
def test_it_ends_with_the_next_command(folder: Path, words: str, following: str) -> None:
    assert " ".join(last(*words.split(), cwd=folder)).startswith(following)


def test_a_program_that_reads_is_told_nothing(folder: Path) -> None:
    done = ffc_id("predict", "sine.csv", "-p", "params.toml", "-o", "c.csv", "--json", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_report_drawn_again(folder: Path) -> None:
    assert ffc_id("identify", "sine.csv", "-o", "result", *COULOMB, cwd=folder).returncode == 0
    assert last("report", "result", cwd=folder)[0] in ("run", "predict", "tune")
