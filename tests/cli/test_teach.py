"""`ffc-id teach`, the real program."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from idtool.log import Log
from idtool.parameters import Controller, Parameters
from idtool.parameters.axis import Axis
from testbench.board.files import stated

from .support import ffc_id

TRAVEL = 2 * 0.0265 * 6 / 7  # m of the slide per rad of the shaft; the pulley's radius is inferred


@pytest.fixture
def parameters() -> Parameters:
    """The paper's tables."""
    per_payload = TRAVEL * 9.80665
    return Parameters(
        axis=Axis("rotary", 2.67),
        gravity_model="slide",
        gravity=stated(base=per_payload * (0.427 + 0.176 / 2), per_payload=per_payload),
        static=stated(coulomb=0.070, static=0.030, stribeck_velocity=0.090, viscous=0.155),
        dynamic=stated(bristle_stiffness=0.051, bristle_damping=0.297),
        controller=Controller(2.05, 1.68, 0.01),
    )


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    with mock.patch.dict(os.environ, COLUMNS="100"):
        return ffc_id(*arguments, cwd=folder)


def test_guides_the_paper_s_axis(tmp_path: Path, parameters: Parameters) -> None:
    parameters.write(tmp_path / "params.toml")
    done = run(
        tmp_path, "teach", "-p", "params.toml", "--rig", "sim:paper", "-o", "run.csv", "--figure", "run.png"
    )
    assert done.returncode == 0, done.stderr
    assert "ms of letting go" in done.stdout
    assert "N moves it at" in done.stdout
    log = Log.read(tmp_path / "run.csv")
    assert log.experiment == "teach"
    assert {"hand_nm", "hand_estimated_nm", "position_command_rad"} <= set(log.frame.columns)
    assert (tmp_path / "run.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"

    again = run(tmp_path, "teach", "-p", "params.toml", "--rig", "sim:paper", "-o", "run.csv")
    assert again.returncode == 3
    assert "already exists" in again.stderr
    quiet = ("-o", "run.csv", "--force", "-q", "--figure", "run.svg")
    assert run(tmp_path, "teach", "-p", "params.toml", "--rig", "sim:paper", *quiet).returncode == 0
    assert "<svg" in (tmp_path / "run.svg").read_text()


def test_json_is_one_document_and_repeats(tmp_path: Path, parameters: Parameters) -> None:
    parameters.write(tmp_path / "params.toml")
    arguments = (
        "teach",
        "-p",
        "params.toml",
        "--rig",
        "sim:paper",
        "--hand-force",
        "5.56",
        "--json",
        "--seed",
        "3",
    )
    first, second = run(tmp_path, *arguments), run(tmp_path, *arguments)
    assert first.returncode == 0, first.stderr
    assert first.stdout == second.stdout
    figures = json.loads(first.stdout)["figures"]
    assert figures["force_n"] == pytest.approx(5.56, rel=0.03)
    assert figures["energy_to_hand"] < 0
    assert len(figures["pushes"]) == 4


@pytest.mark.parametrize("part", ["gravity", "static", "axis"])
def test_a_file_that_lacks_a_part_is_refused(tmp_path: Path, parameters: Parameters, part: str) -> None:
    without: dict[str, object] = {
        "gravity": {"gravity": {}, "gravity_model": None},
        "static": {"static": {}},
        "axis": {"axis": Axis()},
    }[part]
    replace(parameters, **without).write(tmp_path / "params.toml")
    done = run(tmp_path, "teach", "-p", "params.toml", "--rig", "sim:paper")
    assert done.returncode == 3
    assert "params.toml" in done.stderr
    assert {"gravity": "fit-gravity", "static": "fit-static", "axis": "torque constant"}[part] in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


def test_bad_input_is_one_sentence(tmp_path: Path, parameters: Parameters) -> None:
    parameters.write(tmp_path / "params.toml")
    for arguments, code, words in (
        (("-p", "nothing.toml", "--rig", "sim:paper"), 3, "no such file"),
        (("-p", "params.toml"), 2, "--rig is missing; name the axis, as --rig sim:paper"),
        (("-p", "params.toml", "--rig", "sim:papr"), 2, "paper"),
        (("-p", "params.toml", "--payload", "-1"), 2, "payload"),
        (
            ("-p", "params.toml", "--rig", "sim:paper", "--payload", "400"),
            2,
            "--payload: 400 kg would pull with 178 N m by the file, and the drive gives 4 N m",
        ),
        (
            ("-p", "params.toml", "--rig", "sim:paper", "--payload", "20"),
            4,
            "the drive cannot hold this payload: it takes 9.15 N m, and the current limit allows 4; lower",
        ),
        (
            ("-p", "params.toml", "--rig", "sim:paper", "--tilt", "90", "0"),
            2,
            "--tilt: 90 rad is beyond half a turn; --tilt-deg takes degrees",
        ),
        ((), 2, "--params"),
    ):
        done = run(tmp_path, "teach", *arguments)
        assert done.returncode == code, (arguments, done.stderr)
        assert words in done.stderr
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("hand", "moved"),
    [
        (("--hand-force", "0.004"), False),
        (("--hand-speed", "0.0192"), False),
        (("--hand-force", "4"), True),
        (("--hand-speed", "5"), True),
    ],
    ids=["kN", "m/s", "N", "mm/s"],
)
def test_a_hand_that_moves_nothing_is_said(
    tmp_path: Path, parameters: Parameters, hand: tuple[str, str], moved: bool
) -> None:
    parameters.write(tmp_path / "params.toml")
    done = run(tmp_path, "teach", "-p", "params.toml", "--rig", "sim:paper", *hand)
    assert done.returncode == 0, done.stderr
    assert ("note: the simulated hand moved nothing" in done.stdout) != moved


def test_radians_for_degrees_are_said(tmp_path: Path, parameters: Parameters) -> None:
    parameters.write(tmp_path / "params.toml")
    words = ("teach", "-p", "params.toml", "--rig", "sim:paper", "--no-hand", "--duration", "1")
    for angle, said in (("1.5708", True), ("-3.1416", True), ("90", False), ("1.6", False)):
        done = run(tmp_path, *words, "--tilt-deg", "0", angle)
        assert done.returncode == 0, done.stderr
        assert (f"{angle} looks like a part of a turn in rad" in done.stderr) == said


def test_says_what_the_file_s_effects_are_worth(tmp_path: Path, parameters: Parameters) -> None:
    """An offset that only the file knows of: with it the hand is as even as on the bare axis."""
    from idtool.parameters import EffectEntry
    from idtool.rig import opening

    packaged = Path(opening.__file__).with_name("paper.toml").read_text(encoding="utf-8")
    effect = '\n[[effects]]\nname = "nonlinear_viscous"\nquadratic_nm_s2_per_rad2 = 0.4\n'
    (tmp_path / "plant.toml").write_text(packaged + effect, encoding="utf-8")
    extended = parameters.with_effect(EffectEntry("nonlinear_viscous", stated(quadratic=0.4)))
    extended.write(tmp_path / "params.toml")
    done = run(tmp_path, "teach", "-p", "params.toml", "--rig", "sim:plant.toml", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["without_effects"]["force_n"] > document["figures"]["force_n"] + 0.3
    said = run(tmp_path, "teach", "-p", "params.toml", "--rig", "sim:plant.toml")
    assert "the file's effects are worth" in said.stdout


@pytest.mark.long
def test_a_correction_is_compensated_where_it_is_asked_for(tmp_path: Path, parameters: Parameters) -> None:
    """A ripple that the file lacks and a smooth correction holds: the hand is more even with it."""
    from idtool.parameters.correction import Correction
    from idtool.rig import opening

    packaged = Path(opening.__file__).with_name("paper.toml").read_text(encoding="utf-8")
    ripple = (
        '\n[[effects]]\nname = "position_ripple"\ncycles_per_turn = 9.0\namplitude_1_nm = 0.03\n'
        "phase_1_rad = 0.0\namplitude_2_nm = 0.0\nphase_2_rad = 0.0\n"
    )
    (tmp_path / "plant.toml").write_text(packaged + ripple, encoding="utf-8")
    parameters.write(tmp_path / "params.toml")
    knots = np.linspace(-15 * np.pi / 9.0, 15 * np.pi / 9.0, 301)
    Correction("position", False, knots, 0.03 * np.sin(9.0 * knots)).write(tmp_path / "correction.toml")
    asked = ("teach", "-p", "params.toml", "--rig", "sim:plant.toml", "--correction", "correction.toml")
    done = run(tmp_path, *asked, "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["figures"]["uneven_n"] < 0.5 * document["without_effects"]["uneven_n"]
    assert "effects of the file and correction are worth" in run(tmp_path, *asked).stdout
    (tmp_path / "correction.toml").write_text("variable = 1\n")
    refused = run(tmp_path, *asked)
    assert refused.returncode == 3
    assert "correction.toml" in refused.stderr
