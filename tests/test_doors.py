"""A package from outside adds an effect, a rig, a reader and an export; they work everywhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from idtool.cli.export import export
from idtool.cli.words import complete_rig, effect_names

from idtool import InputError, Log, Parameters
from idtool.control.load import Instant
from idtool.control.online import OnlineModel
from idtool.diagnosis.diagnose import diagnose
from idtool.effects import registry
from idtool.effects.base import Effect, EffectParameter
from idtool.effects.hysteresis import Hysteresis
from idtool.effects.inertia import Inertia
from idtool.experiment.recipe import read_recipe
from idtool.experiment.runner import run
from idtool.export.c_controller import export_c
from idtool.export.targets import find
from idtool.importing import import_recording
from idtool.io import entry_points
from idtool.parameters import Controller
from idtool.presentation.mathml import typeset
from idtool.report import write_report
from idtool.report.result_folder import write_results
from idtool.rig import forms, open_rig
from idtool.signals import record
from idtool.verbs.base_model import base_of_rows
from idtool.verbs.identification import Identification
from idtool.verbs.identify import identify
from idtool.verbs.predict import predict
from testbench.imbalance import COSINE, SINE, pulled

PACKAGE = Path(__file__).parent / "outside"
PROGRAM = Path(sys.executable).parent / "ffc-id"


def forget() -> None:
    """Look for entry points anew."""
    entry_points._points.cache_clear()
    registry._from_outside.cache_clear()


def install(folder: Path, project: dict[str, Any]) -> None:
    """What an installer writes beside a package, from its pyproject.toml."""
    place = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    place.mkdir()
    (place / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    lines = []
    for group, points in project["entry-points"].items():
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in points.items())]
    (place / "entry_points.txt").write_text("\n".join(lines) + "\n")


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder from which packages are imported."""
    folder = tmp_path / "site"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))
    forget()
    yield folder
    monkeypatch.undo()
    forget()


@pytest.fixture
def outside(path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The example package, installed."""
    install(path, tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"])
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join((str(PACKAGE), str(path))))
    forget()
    return path


def ffc_id(*words: str | Path) -> str:
    done = subprocess.run([PROGRAM, *words], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.usefixtures("outside")
def test_the_effect_goes_from_the_fit_to_the_board(tmp_path: Path) -> None:
    logs = pulled(tmp_path)
    base = base_of_rows(record(logs), "lugre", "auto")
    library = [effect for effect in registry.library() if effect.name in ("inertia", "imbalance")]
    evidence = diagnose(base.recording, base.fits, library)
    result = Identification(base.recording, evidence, [*base.notes], {}, [*base.stepped_down[0][1]])
    found = result.parameters.effect("imbalance")
    assert found is not None
    assert found.values() == pytest.approx({"sine": SINE, "cosine": COSINE}, rel=0.1)

    folder = tmp_path / "result"
    write_results(result, folder)
    parameters = Parameters.read(folder / "params.toml")
    assert "sine_nm" in (folder / "params.toml").read_text()
    write_report(folder)
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "<h3>imbalance</h3>" in page
    assert typeset("a sin(q) + b cos(q)") in page
    assert 'href="https://example.org/imbalance"' in page
    without = replace(parameters, effects=tuple(e for e in parameters.effects if e.name != "imbalance"))
    more = predict(logs[1:], parameters).frame["torque_predicted_nm"]
    less = predict(logs[1:], without).frame["torque_predicted_nm"]
    assert np.ptp(more - less) > 0.02

    model = OnlineModel(parameters)
    load = model.update(Instant(0.0, 0.01, 0.7, 0.0, tilt_alpha=np.pi / 2))
    values = found.values()
    assert load.effects == pytest.approx(values["sine"] * np.sin(0.7) + values["cosine"] * np.cos(0.7))
    light = replace(parameters, controller=Controller(2.05, 8.0, 0.01, mode="light"))
    export_c(light, tmp_path / "board")
    written = "".join(file.read_text() for file in (tmp_path / "board").iterdir())
    assert "sum->torque += sine * s + cosine * c;" in written


def test_an_effect_of_this_process_needs_no_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`identify(effects=)` hands it to the diagnosis and makes it known; the diagnosis itself is not run."""
    monkeypatch.syspath_prepend(str(PACKAGE))
    monkeypatch.setattr(registry, "_OF_THIS_PROCESS", {})
    from ffc_id_example.imbalance import Imbalance

    with open_rig("sim:bench", seed=1) as rig:
        run(read_recipe("sweep"), rig, tmp_path / "sweep.csv")
    asked: list[Effect] = []

    def refuse(recording: Any, starts: Any, library: Any, *_: Any, **__: Any) -> Any:
        asked.extend(library)
        raise InputError("enough")

    monkeypatch.setattr("idtool.verbs.identify.diagnose", refuse)
    with pytest.raises(InputError, match="enough"):
        identify([Log.read(tmp_path / "sweep.csv")], effects=[Imbalance()])
    assert [effect.name for effect in asked] == [*registry.names()]
    assert asked[-1].name == "imbalance"
    assert registry.get("imbalance") is asked[-1]


@pytest.mark.usefixtures("outside")
def test_the_rig_is_listed_completed_and_runs(tmp_path: Path) -> None:
    assert forms()["memory:NAME"] == "an axis in memory"
    context = click.Context(click.Command("x"))
    assert "memory:" in [item.value for item in complete_rig(context, click.Option(["--rig"]), "")]
    assert "memory:NAME" in ffc_id("rigs")
    log = tmp_path / "sweep.csv"
    ffc_id("run-sweep", "--rig", "memory:mine", "-o", log, "-q")
    assert len(Log.read(log).frame) > 1000
    with pytest.raises(InputError, match=r'unknown option "speed" of rig "memory:a,speed=2"'):
        open_rig("memory:a,speed=2")
    with pytest.raises(InputError, match='did you mean "memory:a"'):
        open_rig("memry:a")


@pytest.mark.usefixtures("outside")
def test_the_effect_is_completed() -> None:
    assert "imbalance" in effect_names()
    assert registry.names()[-1] == "imbalance"


@pytest.mark.usefixtures("outside")
def test_the_reader_is_asked(tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    rows = [
        {"t_us": 1e4 * k, "angle": 30 * np.sin(0.02 * k), "ma": 40 * np.cos(0.02 * k)} for k in range(400)
    ]
    file.write_text("\n".join(map(json.dumps, rows)))
    frame = import_recording(file, torque_constant=2.67).log.frame
    assert frame["position_rad"].max() == pytest.approx(np.deg2rad(30), rel=1e-3)
    ffc_id("import", file, "-o", tmp_path / "log.csv", "--torque-constant", "2.67")
    assert len(Log.read(tmp_path / "log.csv").frame) == 400


@pytest.mark.usefixtures("outside")
def test_the_export_is_listed_completed_and_writes(tmp_path: Path) -> None:
    listed = [item.value for item in export.shell_complete(click.Context(export), "oct")]
    assert listed == ["octave"]
    assert "Added by ffc-id-example." in ffc_id("export", "--help")
    assert "Write the model for Octave and MATLAB." in ffc_id("export", "octave", "--help")
    params = tmp_path / "params.toml"
    params.write_text(
        'schema = "ffc-id/params/1"\n[axis]\nkind = "rotary"\ntorque_constant_nm_per_a = 2.67\n'
        "[friction.static]\ncoulomb_nm = {value = 0.08}\nviscous_nm_s_per_rad = {value = 0.12}\n"
        "static_nm = {value = 0.1}\nstribeck_velocity_rad_s = {value = 0.09}\n"
    )
    ffc_id("export", "octave", "-p", params, "-o", tmp_path / "axis.m", "--name", "elbow")
    assert "elbow.coulomb = 0.08;" in (tmp_path / "axis.m").read_text()


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"citation": ""}, "the effect 'imbalance' has no citation"),
        ({"page": ""}, "the effect 'imbalance' has no page"),
        ({"follows": ("positon",)}, 'follows .positon., which there is not; did you mean "position"'),
        ({"needs": ("load_uprigt",)}, 'needs .load_uprigt., which there is not; did you mean "load_upright"'),
        ({"memory": 1}, "has a memory but no resume"),
        ({"at": Inertia.at}, "has a compiled formula but no numbers"),
        ({"memory": 1, "over": Hysteresis.over}, "has a compiled formula but no acts_on"),
        ({"contribute": Effect.contribute}, "has no formula"),
        (
            {"parameters": (EffectParameter("sine", "torqe", "pull"),)},
            "has no unit for 'sine': there is no dimension 'torqe'; did you mean \"torque\"",
        ),
    ],
)
def test_what_an_effect_lacks_is_said_when_it_is_registered(
    changed: dict[str, Any], sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(PACKAGE))
    from ffc_id_example.imbalance import Imbalance

    lacking = type("Lacking", (Imbalance,), changed)()
    with pytest.raises(InputError, match=sentence):
        registry.add(lacking)


def test_every_effect_of_the_tool_lacks_nothing() -> None:
    for effect in registry.library():
        registry.check(effect)


def test_a_name_is_taken_once() -> None:
    class Mine(Inertia):  # type: ignore[misc]
        pass

    with pytest.raises(InputError, match='there is an effect "inertia" already'):
        registry.add(Mine())


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        ("nowhere:Thing", 'adds "odd" to ffc_id.effects, but nowhere:Thing cannot be loaded'),
        ("math:pi", "math:pi is no Effect"),
        ("idtool.effects.inertia:Inertia", 'the entry point "odd" names the effect "inertia"'),
    ],
)
def test_a_broken_package_is_named(path: Path, value: str, sentence: str) -> None:
    install(path, {"name": "odd", "version": "1", "entry-points": {"ffc_id.effects": {"odd": value}}})
    forget()
    with pytest.raises(InputError, match=sentence):
        registry.library()


@pytest.mark.parametrize(
    ("group", "name", "asks"),
    [
        ("ffc_id.effects", "inertia", registry.library),
        ("ffc_id.rigs", "sim", forms),
        ("ffc_id.exports", "mujoco", lambda: find("mujoco")),
        ("ffc_id.exports", "c", lambda: export.list_commands(click.Context(export))),
    ],
)
def test_a_name_of_the_tool_is_not_taken_silently(
    path: Path, group: str, name: str, asks: Callable[[], Any]
) -> None:
    install(path, {"name": "odd", "version": "1", "entry-points": {group: {name: "odd:THING"}}})
    forget()
    with pytest.raises(
        InputError, match=f'the package odd adds "{name}" to {group}, a name that the tool has'
    ):
        asks()


def test_two_packages_with_one_name_are_told_apart(path: Path) -> None:
    for name in ("one", "two"):
        points = {"ffc_id.rigs": {"arm": f"{name}:ARM"}}
        install(path, {"name": name, "version": "1", "entry-points": points})
    forget()
    with pytest.raises(InputError, match=r'the package (one|two) and the package (one|two) both add "arm"'):
        forms()
