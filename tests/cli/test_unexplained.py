"""What a session left unexplained is said by everything that uses its parameter file, once."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from idtool.experiment.recipe import parse_recipe
from idtool.experiment.runner import run
from idtool.parameters import Parameters
from idtool.rig import open_rig
from idtool.rig.opening import read_plant
from testbench.guided_axes.cases import file_of

from .support import ffc_id

UNEXPLAINED = {"verdict": "unexplained", "left_percent_of_torque": 2.41, "depends_on": ["time", "load"]}
SAID = (
    "the session of the parameter file ended as unexplained: it left 2.41 % of the torque, which depends on "
    "time and load; expect no less"
)
RECIPE = """
schema = "ffc-id/recipe/1"
name = "short"
experiment = "sine"
[[trials]]
kind = "sine"
frequency_hz = [0.5, 1.0]
amplitude_rad_s = 0.5
duration_s = 4.0
"""
TEACH = ("teach", "-p", "p.toml", "--rig", "sim:paper", "--duration", "3", "-o", "taught.csv")
COMMANDS = {
    "predict": ("predict", "log.csv", "-p", "p.toml", "-o", "out.csv"),
    "simulate": ("simulate", "log.csv", "-p", "p.toml", "-o", "out.csv"),
    "tune": ("tune", "-p", "p.toml", "--hand-force", "2"),
    "teach": TEACH,
    "play": ("play", "taught.csv", "-p", "p.toml", "--rig", "sim:paper"),
    "export json": ("export", "json", "-p", "p.toml", "-o", "out.json"),
    "export mujoco": ("export", "mujoco", "-p", "p.toml", "-o", "out.xml"),
    "export c": ("export", "c", "-p", "p.toml", "-o", "board", "--any-position"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log, a taught path, and the file of an axis without a provenance."""
    place = tmp_path_factory.mktemp("unexplained")
    with open_rig("sim:paper", seed=0) as rig:
        run(parse_recipe(RECIPE, "short.toml"), rig, place / "log.csv")
    file_of(read_plant("paper")).write(place / "p.toml")
    assert ffc_id(*TEACH, cwd=place).returncode == 0
    return place


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("provenance", [UNEXPLAINED, {"verdict": "effect_found"}, {}], ids=str)
def test_who_uses_the_file_says_it_once(folder: Path, command: str, provenance: dict[str, Any]) -> None:
    known = Parameters.read(folder / "p.toml")
    replace(known, provenance=provenance).write(folder / "p.toml", force=True)
    force = () if command in ("tune", "play") else ("--force",)
    done = ffc_id(*COMMANDS[command], *force, cwd=folder)
    assert done.returncode == 0, done.stderr
    told = " ".join((done.stdout + done.stderr).split())  # a narrow terminal folds it
    assert told.count(SAID) == (provenance is UNEXPLAINED)
    assert told.count("unexplained") == (provenance is UNEXPLAINED)


def test_what_is_exported_says_it(folder: Path) -> None:
    known = Parameters.read(folder / "p.toml")
    replace(known, provenance=UNEXPLAINED).write(folder / "p.toml", force=True)
    for target in ("mujoco", "c"):
        assert ffc_id(*COMMANDS[f"export {target}"], "--force", cwd=folder).returncode == 0
    for name in ("out.xml", "board/ffc.h"):
        assert "ended as unexplained" in (folder / name).read_text(), name
    done = ffc_id(*COMMANDS["tune"], "--json", cwd=folder)
    assert json.loads(done.stdout)["notes"] == [f"{SAID}."]


@pytest.mark.parametrize(
    ("provenance", "expected"),
    [
        ({"left_percent_of_torque": "much"}, "it left more than noise; expect no less"),
        ({"left_percent_of_torque": float("nan")}, "it left more than noise; expect no less"),
        ({"depends_on": "time"}, "it left more than noise; expect no less"),
        ({"depends_on": [], "left_percent_of_torque": 40}, "it left 40 % of the torque; expect no less"),
    ],
)
def test_a_provenance_that_somebody_edited_is_no_fault(provenance: dict[str, Any], expected: str) -> None:
    said = Parameters(provenance={"verdict": "unexplained", **provenance}).unexplained
    assert said is not None
    assert said.endswith(expected)
