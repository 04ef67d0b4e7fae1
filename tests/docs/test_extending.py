"""The examples of docs/extending.md do what the page says."""

from __future__ import annotations

import importlib
import inspect
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from idtool import Log, Parameters
from idtool.diagnosis.diagnose import diagnose
from idtool.effects import registry
from idtool.effects.base import derivative
from idtool.experiment.recipe import read_recipe
from idtool.experiment.runner import run
from idtool.export.targets import TARGETS, export
from idtool.importing import import_recording, recording
from idtool.rig import open_rig
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from pages.markdown import fences
from testbench.imbalance import COSINE, SINE, pulled

from .support import PROJECT

PAGE = PROJECT / "docs" / "extending.md"


def example(name: str) -> Any:
    """What the block that defines `name` defines."""
    for fence in fences(PAGE):
        if fence.language == "python" and (f"class {name}(" in fence.text or f"def {name}(" in fence.text):
            space: dict[str, Any] = {"__name__": f"example_{name}"}
            exec(compile("\n" * fence.line + fence.text, str(PAGE), "exec"), space)
            return space[name]
    raise AssertionError(f"no example of {name}")


@pytest.mark.long
def test_the_effect_is_named_and_recovered(tmp_path: Path) -> None:
    effect = example("Imbalance")()
    logs = pulled(tmp_path)
    data = record(logs)
    starts = base_of_rows(data, "lugre", "auto").fits
    library = (registry.get("inertia"), registry.get("position_stiffness"), effect)
    found = diagnose(data, starts, library)
    assert "imbalance" in [one.name for one in found.effects], found.selection.candidates
    assert found.final.values["imbalance.sine"] == pytest.approx(SINE, rel=0.05)
    assert found.final.values["imbalance.cosine"] == pytest.approx(COSINE, rel=0.15)


def test_the_effect_keeps_what_the_library_promises(tmp_path: Path) -> None:
    effect = example("Imbalance")()
    with open_rig("sim:bench") as rig:
        run(read_recipe("sine"), rig, tmp_path / "sine.csv")
    motion = record([Log.read(tmp_path / "sine.csv")]).motion
    values = {"sine": 0.3, "cosine": -0.2}
    assert effect.to_values(effect.to_parameters(values)) == values
    slope = derivative(effect, motion, values, effect.coordinates[0]).torque
    np.testing.assert_allclose(slope, np.sin(motion.position), atol=1e-9)
    form = effect.in_c(values)
    assert {"sine", "cosine"} <= form.constants.keys()


CONTRACT = importlib.import_module("rig.test_contract")


@pytest.mark.parametrize("kind", ["MemoryRig", "Motor"])
@pytest.mark.parametrize(
    "name",
    [
        n
        for n, test in vars(CONTRACT).items()
        if n.startswith("test_") and "rig" in inspect.signature(test).parameters
    ],
)
def test_the_rigs_keep_the_contract(name: str, kind: str, tmp_path: Path) -> None:
    test = getattr(CONTRACT, name)
    folder = {"tmp_path": tmp_path} if "tmp_path" in inspect.signature(test).parameters else {}
    test(rig=example(kind)(), **folder)


def test_the_reader_makes_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read = example("read")
    file = tmp_path / "run.jsonl"
    rows = [
        {"t_us": 1e4 * k, "angle": 30 * np.sin(0.02 * k), "ma": 40 * np.cos(0.02 * k)} for k in range(400)
    ]
    file.write_text("\n".join(json.dumps(row) for row in rows))
    monkeypatch.setattr(recording, "read_table", lambda path: read(Path(path).read_bytes(), Path(path)))
    frame = import_recording(file, torque_constant=2.67).log.frame
    assert frame["position_rad"].max() == pytest.approx(np.deg2rad(30), rel=1e-3)
    assert frame["current_a"].iloc[0] == pytest.approx(0.04)
    assert frame["time_s"].iloc[-1] - frame["time_s"].iloc[0] == pytest.approx(3.99)


def test_the_export_writes_every_value(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(TARGETS, "octave", example("Octave")())
    file = tmp_path / "params.toml"
    file.write_text(
        """schema = "ffc-id/params/1"
[axis]
kind = "rotary"
torque_constant_nm_per_a = 2.67
[friction.static]
coulomb_nm = {value = 0.08}
static_nm = {value = 0.1}
stribeck_velocity_rad_s = {value = 0.09}
viscous_nm_s_per_rad = {value = 0.12}
[[effects]]
name = "torque_offset"
[effects.parameters]
offset_nm = {value = 0.02}
"""
    )
    done = export("octave", Parameters.read(file), joint="elbow")
    assert "elbow.coulomb = 0.08;" in done.text
    assert "% Not carried: the effect torque offset." in done.text


def test_the_page_names_every_file_that_knows_most_effects_by_name() -> None:
    page = PAGE.read_text(encoding="utf-8")
    names = [re.compile(rf"\b{name}\b") for name in registry.names()]
    folders = ("idtool", "cli", "pages", "studies", "benchmarks", "testbench", "tests", "docs")
    files = [PROJECT / "README.md", *(file for folder in folders for file in (PROJECT / folder).rglob("*.*"))]
    for file in files:
        if file.suffix in (".py", ".md", ".jinja", ".toml", ".js"):
            text = file.read_text(encoding="utf-8")
            if sum(bool(name.search(text)) for name in names) > 0.7 * len(names):
                assert f"`{file.relative_to(PROJECT)}`" in page


def test_the_page_shows_the_package_as_it_is() -> None:
    shown = [fence.text for fence in fences(PAGE) if fence.language in ("python", "toml")]
    package = PROJECT / "tests" / "outside"
    modules = ("imbalance", "memory_rig", "torque_rig", "json_lines", "octave")
    names = ["pyproject.toml", *(f"ffc_id_example/{name}.py" for name in modules)]
    for name in names:
        assert (package / name).read_text(encoding="utf-8") in shown, name
    assert len(shown) == len(names)
