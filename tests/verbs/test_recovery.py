"""The paper's tables, recovered from runs on `sim:paper` through the commands."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from idtool import Parameters
from tests.cli import support

#: parameter -> (printed value, tolerance); the two gravity torques follow from table 2 and r = 26.5 mm
TABLES = {
    "base": (0.2295, 0.01),
    "per_payload": (0.4457, 0.01),
    "coulomb": (0.070, 0.03),
    "static": (0.030, 0.03),
    "stribeck_velocity": (0.090, 0.03),
    "viscous": (0.155, 0.03),
    "bristle_stiffness": (0.051, 0.05),
    "bristle_damping": (0.297, 0.05),
}


def ffc_id(*arguments: str, cwd: Path) -> str:
    """What the program prints."""
    return of(support.ffc_id(*arguments, cwd=cwd))


def of(done: subprocess.CompletedProcess[str]) -> str:
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("paper")
    for name in ("gravity", "sweep", "sine"):
        words = (f"run-{name}", "--rig", "sim:paper", "--seed", "3", "-o", f"{name}.csv", "-q")
        of(support.ffc_id(*words, cwd=folder))
    return folder


def check(parameters: Parameters) -> None:
    found = parameters.gravity | parameters.static | parameters.dynamic
    for name, (printed, tolerance) in TABLES.items():
        assert found[name].value == pytest.approx(printed, rel=tolerance), name
        assert found[name].identified, name
        assert not found[name].at_bound, name
        assert found[name].stderr is not None


def test_the_three_fits_recover_the_papers_tables(logs: Path) -> None:
    gravity = json.loads(ffc_id("fit-gravity", "gravity.csv", "-p", "params.toml", "--json", cwd=logs))
    static = json.loads(
        ffc_id("fit-static", "sweep.csv", "-p", "params.toml", "--json", "--figure", "curve.png", cwd=logs)
    )
    dynamic = json.loads(ffc_id("fit-dynamic", "sine.csv", "-p", "params.toml", "--json", cwd=logs))
    check(Parameters.read(logs / "params.toml"))
    assert 0.0 < gravity["quality"]["average_error_percent"] < 0.96  # the paper's own figure
    assert 0.9965 < static["quality"]["adjusted_r2"] <= 1.0  # likewise
    assert any("RISES" in note for note in static["notes"])
    assert any("not steady" in note for note in static["notes"])
    assert dynamic["quality"]["relative_percent"] < 2.0
    assert (logs / "curve.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.long
def test_identify_recovers_them_in_one_go_and_finds_nothing_missing(logs: Path) -> None:
    diagnosis = json.loads(
        ffc_id("identify", "gravity.csv", "sweep.csv", "sine.csv", "-o", "result", "--json", cwd=logs)
    )
    check(Parameters.read(logs / "result" / "params.toml"))
    assert diagnosis["verdict"] == "adequate"
    for name in ("params.toml", "diagnosis.json", "report.html", "evidence.json", "evidence.csv.gz"):
        assert (logs / "result" / name).stat().st_size > 500
    assert diagnosis == json.loads((logs / "result" / "diagnosis.json").read_text())


def test_evolutionary_search_ends_where_the_deterministic_one_does(logs: Path) -> None:
    of(support.ffc_id("fit-static", "sweep.csv", "-p", "direct.toml", "-q", cwd=logs))
    shutil.copy(logs / "direct.toml", logs / "esch.toml")
    for file, optimizer in (("direct.toml", "direct"), ("esch.toml", "esch")):
        words = ("fit-dynamic", "sine.csv", "-p", file, "--optimizer", optimizer, "-q")
        of(support.ffc_id(*words, cwd=logs))
    direct, esch = (Parameters.read(logs / file) for file in ("direct.toml", "esch.toml"))
    for name, parameter in direct.dynamic.items():
        assert esch.dynamic[name].value == pytest.approx(parameter.value, rel=1e-3)
