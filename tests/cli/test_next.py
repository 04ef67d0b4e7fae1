"""Every command that computes ends with the one command to go on with."""

from __future__ import annotations

import gzip
import os
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from idtool.cli.commands import ffc_id as program
from idtool.cli.onward import logs_beside

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
    told = {"logs": ["sine.csv", "gone.csv"], "rig": "sim:bench"}
    replace(known, provenance=told).write(folder / "told.toml")
    (folder / "own").mkdir()
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
        ("simulate sine.csv -p params.toml -o b.csv", "fit-motion sine.csv -p motion.toml"),
        ("compare params.toml params.toml", "run --recipe validation --rig SPEC -o validation.csv"),
        ("compare params.toml told.toml", "compare params.toml told.toml sine.csv"),
        ("compare params.toml params.toml sine.csv", "fleet"),
        ("calibrate swing.csv --mass 0.5 --lever 0.1", "identify swing.csv --torque-constant"),
        ("export json -p params.toml -o axis.json", "tune -p params.toml"),
        ("export urdf -p params.toml -o axis.urdf", "tune -p params.toml"),
        ("export urdf -p told.toml -o b.urdf", "export urdf -p told.toml -o b.urdf --force sine.csv"),
        ("export c -p params.toml -o board --any-position", "teach -p params.toml --rig SPEC --tare"),
        ("export c -p told.toml -o told --any-position", "teach -p told.toml --rig sim:bench --tare"),
        ("tune -p told.toml --hand-force 2 --lever 0.1 --write", "teach -p told.toml --rig sim:bench --tare"),
        ("init --kind rotary -o own/axis.toml", "import recording.csv -o log.csv"),
        ("init --kind rotary -o axis.toml", "identify --axis axis.toml sine.csv -o result"),
        (f"identify inverted.csv -o wrong {' '.join(COULOMB)}", "plot inverted.csv"),
    ],
)
def test_it_ends_with_the_next_command(folder: Path, words: str, following: str) -> None:
    assert " ".join(last(*words.split(), cwd=folder)).startswith(following)


def test_calibrate_names_no_parameter_file_that_is_not_there(folder: Path, tmp_path: Path) -> None:
    shutil.copy(folder / "swing.csv", tmp_path)
    words = ["calibrate", "swing.csv", "--mass", "0.5", "--lever", "0.1", "--torque-constant", "2.5"]
    assert last(*words, cwd=tmp_path) == ["identify", "swing.csv", "-o", "result"]
    (tmp_path / "result").mkdir()
    (tmp_path / "result" / "params.toml").write_text("")
    assert last(*words, cwd=tmp_path)[-2:] == ["-p", "result/params.toml"]


def test_a_program_that_reads_is_told_nothing(folder: Path) -> None:
    done = ffc_id("predict", "sine.csv", "-p", "params.toml", "-o", "c.csv", "--json", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short session of a simulated rig; its sweep is gzipped, and something else lies beside it."""
    folder = tmp_path_factory.mktemp("session")
    for recipe, options in (("gravity", ("--payloads", "0,1")), ("sweep", ("--speeds", "0.1,0.2,0.3"))):
        words = (f"run-{recipe}", *options, "--rig", "sim:bench", "-o", f"{recipe}.csv")
        assert ffc_id(*words, cwd=folder).returncode == 0
    plain = folder / "sweep.csv"
    (folder / "sweep.csv.gz").write_bytes(gzip.compress(plain.read_bytes()))
    plain.unlink()
    (folder / "broken.csv.gz").write_bytes(b"no gzip")
    (folder / "notes.csv").write_text('experiment,"sine"\n')
    return folder


def test_a_fit_goes_on_with_the_log_beside_it_or_with_a_run_on_its_rig(session: Path) -> None:
    (session / "logs").symlink_to(session)
    gravity = last("fit-gravity", "logs/gravity.csv", "-p", "params.toml", cwd=session)
    assert gravity == ["fit-static", "logs/sweep.csv.gz", "-p", "params.toml"]
    static = last("fit-static", "sweep.csv.gz", "-p", "params.toml", cwd=session)
    assert static == ["run-sine", "--rig", "sim:bench", "-o", "sine.csv"]
    assert Parameters.read(session / "params.toml").rig == "sim:bench"
    # what was recorded elsewhere may be all there is
    frame = Log.read(session / "sweep.csv.gz").frame
    Log(frame, Axis("rotary", 2.67)).write(session / "own.csv")
    again = last("fit-static", "own.csv", "-p", "params.toml", cwd=session)
    assert again == ["fit-dynamic", "own.csv", "-p", "params.toml"]


def test_what_a_session_lacks_is_run_on_its_rig(session: Path) -> None:
    said = ffc_id("check", "sweep.csv.gz", cwd=session).stdout
    assert "try ffc-id run-gravity --rig sim:bench -o gravity.csv" in said
    axis = Log.read(session / "sweep.csv.gz").axis
    Log(Log.read(session / "sweep.csv.gz").frame, axis).write(session / "from-elsewhere.csv")
    said = ffc_id("check", "from-elsewhere.csv", cwd=session).stdout
    assert "try ffc-id run-gravity --rig SPEC -o gravity.csv" in said


def test_a_report_drawn_again(folder: Path) -> None:
    assert ffc_id("identify", "sine.csv", "-o", "result", *COULOMB, cwd=folder).returncode == 0
    assert last("report", "result", cwd=folder)[0] in ("run", "predict", "tune")


def test_what_lies_beside_a_log_and_is_none_stops_nothing(tmp_path: Path) -> None:
    """A damaged archive, a folder, and a pipe that nobody writes into."""
    head = b'# ffc-id-log = 1\n# experiment = "sine"\n'
    (tmp_path / "sine.csv").write_bytes(head)
    damaged = bytearray(gzip.compress(head * 100))
    damaged[12:20] = b"\xff" * 8
    (tmp_path / "bad.csv.gz").write_bytes(damaged)
    (tmp_path / "cut.csv.gz").write_bytes(gzip.compress(head)[:14])
    (tmp_path / "folder.csv").mkdir()
    os.mkfifo(tmp_path / "pipe.csv")
    assert logs_beside([tmp_path / "given.csv"], ["sine"]) == [tmp_path / "sine.csv"]
