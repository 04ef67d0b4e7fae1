"""`ffc-id play`, the real program; and a payload that was told and is not mounted."""

from __future__ import annotations

import io
import json
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from idtool.cli.play import _show
from idtool.cli.screen import Screen

from idtool.guiding.playback import Played
from idtool.log import Log
from idtool.parameters import Parameters

from .support import ffc_id
from .test_teach import TRAVEL, parameters, run

__all__ = ["parameters"]  # a fixture of the neighbour


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the simulated hand taught on the paper's axis."""
    folder = tmp_path_factory.mktemp("taught")
    parameters.__wrapped__().write(folder / "params.toml")  # type: ignore[attr-defined]
    done = ffc_id("teach", "-p", "params.toml", "--rig", "sim:paper", "-o", "taught.csv", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def played(taught: Path, speed: str) -> tuple[str, ...]:
    """The command that plays it with its parameter file, so many times as fast."""
    rig = ("--rig", "sim:paper", "-p", str(taught / "params.toml"), "--payload", "0.4")
    return ("play", str(taught / "taught.csv"), *rig, "--speed", speed)


def test_plays_what_was_taught(taught: Path, tmp_path: Path) -> None:
    done = run(tmp_path, *played(taught, "0.5"), "-o", "played.csv", "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["stopped"] is None
    assert 0.0 < document["rms_error_mm"] < 0.1
    assert (document["rig"], document["simulated"]) == ("sim:paper", True)
    hand = Log.read(taught / "taught.csv").frame["position_rad"]
    repeated = Log.read(tmp_path / "played.csv").frame["position_rad"]
    assert np.ptp(repeated) == pytest.approx(np.ptp(hand), rel=0.02)


def test_without_a_log_the_next_command_is_the_same_with_one(taught: Path) -> None:
    """As it was typed: a pair of numbers as two words, a flag without any, an argument without its name."""
    rig = ("--rig", "sim:paper", "-p", "params.toml")
    for words, name in (
        (("teach", *rig, "--tilt-deg", "0", "10", "--duration", "1", "--no-hand"), "taught.csv"),
        (("play", "taught.csv", *rig, "--payload", "0.4"), "played.csv"),
    ):
        done = ffc_id(*words, cwd=taught)
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith("rig: sim:paper (simulated)\n")
        first, *rest = shlex.split(done.stderr.splitlines()[-1].removeprefix("next: ffc-id "))
        assert first == words[0]
        assert rest[-2:] == ["-o", name]
        assert sorted(rest[:-2]) == sorted(words[1:])


@pytest.mark.parametrize(
    ("samples", "interrupted", "told"),
    [
        (0, True, "ended on the way to the path.\n"),
        (2, True, "played in part; position off by 1.00 mrad rms (loop's lag 50 ms, led by that).\n"),
        (2, False, "played; position off by 1.00 mrad rms (loop's lag 50 ms, led by that).\n"),
    ],
)
def test_what_was_not_played_has_no_error(samples: int, interrupted: bool, told: str) -> None:
    """It was told as nan."""
    along = np.zeros(samples)
    ended = Played(along, along + 1e-3, along, lag_s=0.05, stopped=None, interrupted=interrupted)
    shown = io.StringIO()
    _show(Screen(200, shown), ended, None)
    assert shown.getvalue() == told


def test_waypoints_can_be_edited_and_played(taught: Path, tmp_path: Path) -> None:
    source = str(taught / "taught.csv")
    done = run(tmp_path, "play", source, "--rig", "sim:paper", "--waypoints", "points.toml")
    assert done.returncode == 0, done.stderr
    assert 2 < len(tomllib.loads((tmp_path / "points.toml").read_text())["points"]) < 60
    again = run(tmp_path, "play", "points.toml", "--rig", "sim:paper", "--loop", "2", "--json")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["stopped"] is None
    text = (tmp_path / "points.toml").read_text()
    # the last point: the way back from a slip further within would take minutes at the rig's top speed
    before, _, last = text.rpartition("position_rad = ")
    (tmp_path / "points.toml").write_text(f"{before}position_rad = 2.5 }}{last.partition('}')[2]}")
    slip = run(tmp_path, "play", "points.toml", "--rig", "sim:paper", "--speed", "10")
    assert "and is cut there" in slip.stderr


def test_a_contact_without_a_model_is_a_mistake(taught: Path, tmp_path: Path) -> None:
    done = run(tmp_path, "play", str(taught / "taught.csv"), "--rig", "sim:paper", "--contact", "5")
    assert done.returncode == 2
    assert "parameter file" in done.stderr


def test_it_stops_at_what_the_model_cannot_explain_and_says_where(taught: Path, tmp_path: Path) -> None:
    """Told more payload than it carries, it feels the difference once the limit is below that."""
    done = run(tmp_path, *played(taught, "3"), "--contact", "0.2", "--json")
    assert done.returncode == 4, done.stdout
    assert json.loads(done.stdout)["stopped"] is not None


def test_a_camera_that_is_not_mounted_makes_the_axis_rise_slowly(
    tmp_path: Path, parameters: Parameters
) -> None:
    """As the paper's: set to its camera's payload, with none there, while the button is down."""
    parameters.write(tmp_path / "params.toml")
    common = ("teach", "-p", "params.toml", "--rig", "sim:paper", "--no-hand", "--duration", "5")
    done = run(tmp_path, *common, "--payload", "0", "--told-payload", "0.4", "-o", "rise.csv")
    assert done.returncode == 0, done.stderr
    frame = Log.read(tmp_path / "rise.csv").frame
    position, time = frame["position_rad"].to_numpy(), frame["time_s"].to_numpy()
    assert TRAVEL * (position[-1] - position[0]) > 5e-3
    speed = np.diff(position[::20]) / np.diff(time[::20])
    assert np.max(np.abs(speed)) < 0.3
    still = run(tmp_path, *common, "--payload", "0.4", "-o", "still.csv")
    assert still.returncode == 0, still.stderr
    assert np.ptp(Log.read(tmp_path / "still.csv").frame["position_rad"]) < 3e-3


def test_a_file_that_cannot_feel_a_contact_is_named(taught: Path, tmp_path: Path) -> None:
    text = (taught / "params.toml").read_text().splitlines()
    (tmp_path / "p.toml").write_text("\n".join(line for line in text if "torque_constant" not in line))
    done = run(tmp_path, "play", str(taught / "taught.csv"), "--rig", "sim:paper", "-p", "p.toml")
    assert done.returncode == 3
    assert done.stderr.count("\n") == 1
    assert "p.toml, axis.torque_constant_nm_per_a: the parameter file has no torque constant" in done.stderr
