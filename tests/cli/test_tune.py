"""`ffc-id tune`, the real program."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from idtool.parameters import Parameters
from idtool.rig.opening import read_plant
from testbench.guided_axes.cases import file_of

from .support import PROGRAM, ffc_id
from .terminal import Terminal


@pytest.fixture
def params(tmp_path: Path) -> Path:
    file_of(read_plant("paper")).write(tmp_path / "params.toml")
    return tmp_path / "params.toml"


def test_writes_the_gains_and_teach_takes_them(params: Path) -> None:
    done = ffc_id("tune", "-p", params, "--hand-force", "2", "--speed", "19.2", "--write", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "ffc-id/tuning/1"
    assert document["written"]
    assert min(m["gain"] for m in document["margins"]) >= 1.1
    controller = Parameters.read(params).controller
    assert controller is not None
    assert controller.mode == "light"
    assert controller.loop_gain == pytest.approx(document["controller"]["loop_gain"])
    guided = ffc_id("teach", "-p", params, "--tare", "--rig", "sim:paper,sensors=dynamixel", "--json")
    assert guided.returncode == 0, guided.stderr
    told = json.loads(guided.stdout)
    assert not told["notes"]
    figures = told["figures"]
    assert figures["force_n"] == pytest.approx(2.0, rel=0.15)
    assert figures["speed_mm_s"] == pytest.approx(19.2, rel=0.05)
    assert figures["stop_ms"] <= 48.0

    untared = ffc_id("teach", "-p", params, "--rig", "sim:paper,sensors=dynamixel", "--json")
    (note,) = json.loads(untared.stdout)["notes"]
    assert note.startswith("the axis was not tared")


def test_gains_that_brake_the_hand_are_shown(params: Path) -> None:
    done = ffc_id("tune", "-p", params, "--hand-force", "900")
    assert done.returncode == 0, done.stderr
    assert "note: at 19.2 mm/s these gains take 900 N" in done.stdout


def test_refuses_and_leaves_the_file_alone(params: Path) -> None:
    before = params.read_bytes()
    done = ffc_id("tune", "-p", params, "--hand-force", "1", "--write")
    assert done.returncode == 3
    assert "ask for" in done.stderr
    assert "Traceback" not in done.stderr
    assert params.read_bytes() == before


@pytest.mark.parametrize("wanted", [("--hand-force", "1e-300"), ("--hand-force", "2", "--speed", "1e-300")])
def test_a_feel_that_no_hand_could_tell_is_refused(params: Path, wanted: tuple[str, ...]) -> None:
    """Its gains would be zero or beyond every float, and so would the margins."""
    done = ffc_id("tune", "-p", params, *wanted)
    assert (done.returncode, done.stdout) == (2, "")
    assert "1e-300 is not in the range 0.001<=x<=" in done.stderr


def test_shows_before_it_writes(params: Path) -> None:
    """Nobody to ask and no --write: shown, and the file as it was."""
    before = params.read_bytes()
    done = ffc_id("tune", "-p", params, "--hand-force", "2")
    assert done.returncode == 0, done.stderr
    assert "K_c" in done.stdout
    assert done.stdout.endswith(f"not written: {params}\n")
    assert "--write" in done.stderr
    assert params.read_bytes() == before
    for answer, same in (("n", True), ("y", False)):
        with Terminal([PROGRAM, "tune", "-p", params, "--hand-force", "2"]) as terminal:
            terminal.until("write them into")
            terminal.send(f"{answer}\r")
            assert terminal.finish(60) == 0
        assert (params.read_bytes() == before) == same


def test_a_tare_needs_the_light_mode(params: Path) -> None:
    done = ffc_id("teach", "-p", params, "--rig", "sim:paper", "--tare")
    assert done.returncode == 2
    assert "ffc-id tune" in done.stderr
