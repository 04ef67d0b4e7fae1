"""`ffc-id export mujoco|urdf|ros2|json`: the real program, its words, exit codes and files."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from idtool.log import Log
from idtool.parameters import EffectEntry, Parameter, Parameters
from idtool.parameters.axis import Axis

from .support import ffc_id


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    values = {"coulomb": 0.08, "static": 0.1, "stribeck_velocity": 0.1, "viscous": 0.12}
    Parameters(
        axis=Axis("rotary", 2.5),
        static={name: Parameter(value) for name, value in values.items()},
        effects=(EffectEntry("inertia", {"inertia": Parameter(0.01)}),),
    ).write(tmp_path / "params.toml")
    time = np.arange(2000) * 0.01
    speed = 0.5 * np.sin(time)
    torque = 0.09 * np.sign(speed) + 0.12 * speed + 0.005 * np.cos(time)
    frame = pd.DataFrame({"trial": 0, "time_s": time, "velocity_rad_s": speed, "current_a": torque / 2.5})
    Log(frame, Axis("rotary", 2.5), "sine").write(tmp_path / "sine.csv")
    return tmp_path


@pytest.mark.parametrize("target", ["mujoco", "urdf", "ros2", "json"])
def test_each_target_says_what_it_lacks_and_costs(folder: Path, target: str) -> None:
    arguments = ("export", target, "-p", "params.toml", "-o", "out", "sine.csv")
    done = ffc_id(*arguments, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "next: ffc-id tune -p params.toml --hand-force 2\n")
    assert "the whole model: sine" in done.stdout
    assert done.stdout.endswith("written: out\n")
    written = (folder / "out").read_text()
    again = ffc_id(*arguments, "--force", "--json", cwd=folder)
    document = json.loads(again.stdout)
    assert document["schema"] == "ffc-id/export/1"
    assert (document["target"], document["file"], document["unit"]) == (target, "out", "N m")
    assert document["errors"]["full"]["sine"]["rows"] == 2000
    for sentence in document["not_carried"]:
        assert f"not carried: {sentence}\n" in done.stdout
    assert (folder / "out").read_text() == written
    if target in ("mujoco", "urdf"):
        errors = {model: found["sine"]["rmse"] for model, found in document["errors"].items()}
        assert errors["exported"] < errors["copied"]
        assert any("Stribeck" in sentence for sentence in document["not_carried"])


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["urdf", "-p", "no.toml", "-o", "out"], 3, "ffc-id: no.toml: no such file; check the path."),
        (["urdf", "-p", "params.toml", "-o", "sine.csv"], 3, "already exists; pass --force"),
        (["urdf", "-p", "params.toml", "-o", "out", "no.csv"], 3, "no.csv: no such file"),
        (["urdf", "-p", "params.toml", "-o", "out", "--name", "a b"], 2, "is no name for a joint"),
        (["mujoco", "-p", "params.toml", "-o", "out", "--friction", "lugre"], 2, "is not one of"),
        (["gazebo", "-p", "params.toml", "-o", "out"], 2, 'no command "gazebo"; known are '),
        (["urdf", "-o", "out"], 2, "Missing option"),
    ],
)
def test_refusals(folder: Path, arguments: list[str], code: int, expected: str) -> None:
    done = ffc_id("export", *arguments, cwd=folder)
    assert done.returncode == code
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert not (folder / "out").exists()


def test_help_lists_the_targets() -> None:
    text = ffc_id("export", "--help").stdout
    for target in ("mujoco", "urdf", "ros2", "json"):
        assert target in text
