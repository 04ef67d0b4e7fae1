"""Short sessions on simulated rigs: recipes as text, plants as changes of the bench's."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from idtool.cli.main import main

from idtool import Log
from idtool.experiment.recipe import parse_recipe
from idtool.experiment.runner import run
from idtool.rig import open_rig

SWEEP = """
schema = "ffc-id/recipe/1"
name = "sweep"
experiment = "sweep"
period_s = 0.01
[[trials]]
kind = "back_and_forth"
tilt_alpha_rad = 1.5707963267948966
speed_rad_s = [0.02, 0.05, 0.1, 0.2, 0.3, 0.4]
travel_rad = [0.2, 0.3, 0.5, 0.6, 0.6, 0.6]
"""
SINE = """
schema = "ffc-id/recipe/1"
name = "sine"
experiment = "sine"
period_s = 0.005
[[trials]]
kind = "sine"
tilt_alpha_rad = 1.5707963267948966
frequency_hz = [0.2, 0.5, 1.0]
amplitude_rad_s = [0.3, 0.4, 0.4]
duration_s = [10.0, 6.0, 4.0]
"""
GRAVITY = """
schema = "ffc-id/recipe/1"
name = "gravity"
experiment = "gravity"
period_s = 0.01
[[trials]]
kind = "back_and_forth"
payload_kg = [0.0, 0.4, 0.8, 1.2]
speed_rad_s = 0.2
travel_rad = 0.4
"""


def changed(recipe: str, **keys: object) -> str:
    """A recipe with other values for keys that it has."""
    for key, value in keys.items():
        recipe, count = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", recipe)
        assert count == 1, key
    return recipe


def plant(folder: Path, **keys: object) -> str:
    """SPEC of a rig like `sim:bench` with other values for keys of its plant file."""
    text = changed((resources.files("idtool.rig") / "bench.toml").read_text(), **keys)
    file = folder / f"plant{len(list(folder.glob('plant*.toml')))}.toml"
    file.write_text(text)
    return f"sim:{file}"


def record(recipe: str, file: Path, rig: str = "sim:bench", seed: int = 1) -> Log:
    """Run a recipe and read its log."""
    with open_rig(rig, seed=seed) as opened:
        run(parse_recipe(recipe, "test"), opened, file)
    return Log.read(file)


def ffc_id(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> tuple[int, str, str]:
    """Run the program in this process: exit code, standard output, standard error."""
    capsys.readouterr()
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    said = capsys.readouterr()
    return int(end.value.code or 0), said.out, said.err


def document(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> Any:
    """The JSON document of a command that must end well."""
    code, out, err = ffc_id(capsys, *arguments, "--json")
    assert code == 0, err
    return json.loads(out)
