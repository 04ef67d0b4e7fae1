"""`ffc-id run-...`, `rigs` and `recipes`: the real program, its words, exit codes and files."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from idtool.cli.main import main

from idtool.experiment.recipe import recipe_text
from idtool.log import Log

PROGRAM = [sys.executable, "-c", "from idtool.cli.main import main; main()"]
SHORT = """
schema = "ffc-id/recipe/1"
name = "short"
experiment = "sine"
[[trials]]
kind = "sine"
tilt_alpha_rad = 1.5707963267948966
frequency_hz = [1.0, 2.0]
amplitude_rad_s = 0.5
duration_s = 2.0
"""
#: three hours of rig time, so that a test is always in time to interrupt it
LONG = """
schema = "ffc-id/recipe/1"
name = "long"
experiment = "gravity"
[[trials]]
kind = "back_and_forth"
speed_rad_s = 0.2
travel_rad = 2.0
repeats = 500
"""


SHORT_RUN = ("--recipe", "short.toml", "--rig", "sim:paper", "-o", "log.csv")


def environment() -> dict[str, str]:
    return {**os.environ, "COLUMNS": "100", "TERM": "xterm"}


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


Program = Callable[..., Done]


@pytest.fixture
def ffc_id(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Program:
    """The command line in this process, inside `folder`; signals and terminals need a real one."""
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "100")

    def run(*arguments: str) -> Done:
        with pytest.raises(SystemExit) as stop:
            main(list(arguments))
        printed = capsys.readouterr()
        return Done(int(stop.value.code or 0), printed.out, printed.err)

    return run


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "short.toml").write_text(SHORT)
    (tmp_path / "long.toml").write_text(LONG)
    return tmp_path


def test_a_run_and_its_json(ffc_id: Program, folder: Path) -> None:
    done = ffc_id("run-sine", "--recipe", "short.toml", "--rig", "sim:paper", "-o", "log.csv")
    assert (done.returncode, done.stderr) == (0, "next: ffc-id check log.csv\n")
    assert done.stdout == "log.csv: 800 rows, 2 trials, 6 s of rig time on sim:paper (simulated)\n"
    assert Log.read(folder / "log.csv").experiment == "sine"

    again = ffc_id(
        "run", "--recipe", "short.toml", "--rig", "sim:bench", "-o", "log.csv", "--force", "--json"
    )
    assert (again.returncode, again.stderr) == (0, "")
    document = json.loads(again.stdout)
    assert document.pop("duration_s") == pytest.approx(6.5, abs=1)
    assert document == {
        "file": "log.csv",
        "experiment": "sine",
        "recipe": "short",
        "rig": "sim:bench",
        "simulated": True,
        "rows": 800,
        "trials": 2,
        "interrupted": False,
        "resumed_trials": 0,
        "samples": 800,
        "overruns": 0,
        "longest_period_s": pytest.approx(0.005),
    }


def test_one_trial_is_counted_as_one(ffc_id: Program, folder: Path) -> None:
    (folder / "one.toml").write_text(SHORT.replace("[1.0, 2.0]", "[1.0]"))
    done = ffc_id("run", "--recipe", "one.toml", "--rig", "sim:paper", "-o", "log.csv")
    assert done.stdout.startswith("log.csv: 400 rows, 1 trial, 2 s of rig time on sim:paper")


def test_the_same_seed_is_the_same_log_and_quiet_is_quiet(ffc_id: Program, folder: Path) -> None:
    logs = []
    for seed in ("3", "3", "4"):
        done = ffc_id("run", *SHORT_RUN, "--force", "-q", "--seed", seed)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        logs.append((folder / "log.csv").read_bytes())
    assert logs[0] == logs[1] != logs[2]


def test_a_simulated_axis_is_no_default(ffc_id: Program, folder: Path) -> None:
    """A script that forgot its rig must not go on with the log of a simulation."""
    done = ffc_id("run-sine", "--recipe", "short.toml", "-o", "log.csv")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "ffc-id: --rig is missing; name the axis, as --rig sim:paper (simulated) or --rig dynamixel:DEVICE.\n"
    )
    assert not (folder / "log.csv").exists()


def test_payloads_and_tilt_of_the_command_take_the_place_of_the_recipe_s(
    ffc_id: Program, folder: Path
) -> None:
    (folder / "two.toml").write_text(LONG.replace("500", "1"))
    words = ("--recipe", "two.toml", "--rig", "sim:paper", "-o", "log.csv")
    done = ffc_id("run-gravity", *words, "--payloads", "0,0.5,1", "--tilt-deg", "30", "0")
    assert done.returncode == 0, done.stderr
    frame = Log.read(folder / "log.csv").frame
    assert frame.groupby("trial")["payload_kg"].first().tolist() == [0.0, 0.5, 1.0]
    assert frame["tilt_alpha_rad"].unique() == pytest.approx([0.5236], abs=1e-4)
    wrong = ffc_id("run-gravity", *words, "--payloads", "0;1", "--force")
    assert wrong.returncode == 2
    assert wrong.stderr.count("\n") == 1


def test_a_payload_in_grams_is_doubted_before_anything_moves(ffc_id: Program, folder: Path) -> None:
    (folder / "two.toml").write_text(LONG.replace("500", "1"))
    words = ("--recipe", "two.toml", "--rig", "sim:paper", "-o", "log.csv", "--force")
    done = ffc_id("run-gravity", *words, "--payloads", "0,500")
    assert done.returncode == 4
    assert done.stderr.startswith(
        "note: the drive gives 4 N m, which holds 500 kg on a lever of 0.82 mm at most: payloads are in kg.\n"
    )
    assert "note" not in ffc_id("run-gravity", *words, "--payloads", "0,0.5").stderr


def test_a_recipe_of_another_experiment_is_told(ffc_id: Program) -> None:
    done = ffc_id("run-sweep", *SHORT_RUN)
    assert done.returncode == 0
    assert done.stderr == (
        'note: recipe short is marked as experiment "sine", and so will be the log; '
        'run-sweep expects "sweep".\nnext: ffc-id check log.csv\n'
    )


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["run-sine", "--rig", "sim:papr", "-o", "x.csv"], 2, 'rig "papr"; did you mean "paper"'),
        (["run-sine", "--rig", "sin:paper", "-o", "x.csv"], 2, 'rig "sin:paper"; did you mean "sim:paper"'),
        (["run-sine", "--rig", "sim:no.toml", "-o", "x.csv"], 3, "no.toml: no such file"),
        (["run-sine", "--rig", "dynamixel:/dev/none", "-o", "x.csv"], 4, "cannot open /dev/none: there"),
        (["run-sine", "--recipe", "sinus", "-o", "x.csv"], 2, 'unknown recipe "sinus"; did you mean "sine"'),
        (["run-sine", "--recipe", "no.toml", "-o", "x.csv"], 3, "no such file; ffc-id recipes lists"),
        (["run-sine", "--recipe", ".", "-o", "x.csv"], 3, "is a folder where a recipe should be"),
        (["run-gravity", "--tilt-deg", "400", "0", "-o", "x.csv"], 2, "400 degrees is beyond half a turn"),
        (["run-gravity", "--tilt-deg", "60", "-o", "x.csv"], 2, "give both angles, ALPHA and BETA (30 0);"),
        (["run-sine", "-o", "short.toml"], 3, "short.toml: already exists; pass --force"),
        (["run-sine", "-o", "."], 3, "folder"),
        (["run-sine", "-o", ".", "--force"], 3, "folder"),
        (["run-sine", "-o", "no/x.csv"], 3, "make the folder no first"),
        (["run", "--recipe", "short.toml", "-o", "short.toml", "--force"], 2, "is what is read here"),
        (["run", "-o", "x.csv"], 2, "Missing option '--recipe'"),
        (["run-sine"], 2, "Missing option '-o' / '--output' (The log); ffc-id run-sine --help shows"),
        (["run-sine", "--seed", "-1", "-o", "x.csv"], 2, "--seed"),
        (["run-sin", "-o", "x.csv"], 2, 'no command "run-sin"; did you mean "run-sin'),
        (["recipes", "show", "swep"], 2, 'unknown recipe "swep"; did you mean "sweep"'),
    ],
)  # fmt: skip
def test_refusals(ffc_id: Program, folder: Path, arguments: list[str], code: int, expected: str) -> None:
    done = ffc_id(*arguments)
    assert (done.returncode, done.stdout) == (code, ""), done.stderr
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1
    assert sorted(file.name for file in folder.iterdir()) == ["long.toml", "short.toml"]
    assert (folder / "short.toml").read_text() == SHORT


def test_limits_of_the_rig_name_recipe_key_and_remedy(ffc_id: Program, folder: Path) -> None:
    (folder / "far.toml").write_text(LONG.replace("2.0", "9.0").replace("500", "1"))
    done = ffc_id("run-gravity", "--recipe", "far.toml", "--rig", "sim:paper", "-o", "log.csv")
    assert done.returncode == 3
    assert done.stderr == (
        "ffc-id: far.toml, trials[0].travel_rad: moves over 9 rad, the rig has 4.6; lower it.\n"
    )
    assert not (folder / "log.csv").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_a_valid_log(folder: Path, number: signal.Signals) -> None:
    arguments = ["run-gravity", "--recipe", "long.toml", "--rig", "sim:bench", "-o", "log.csv"]
    log = folder / "log.csv"
    with subprocess.Popen(
        [*PROGRAM, *arguments], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            until = time.monotonic() + 30
            while not log.exists() or log.stat().st_size < 20_000:
                assert process.poll() is None, process.stderr.read() if process.stderr else ""
                assert time.monotonic() < until
                time.sleep(0.01)
            process.send_signal(number)
            out, told = process.communicate(timeout=20)
        finally:
            process.kill()
    assert process.returncode == 130
    assert "Traceback" not in told
    read = Log.read(log)
    assert not read.incomplete
    assert read.experiment == "gravity"
    assert out == ""
    assert told == (
        f"note: interrupted: the axis was stopped; {len(read.frame)} rows are kept in log.csv "
        "(0 of 1 trials finished).\n"
    )


@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_a_terminal_gets_a_bar_with_the_time_left(folder: Path) -> None:
    import pty

    mine, theirs = pty.openpty()
    shown = b""
    with subprocess.Popen(
        [*PROGRAM, "run-sweep", "--rig", "sim:paper", "-o", "log.csv", "--json"],
        cwd=folder,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=theirs,
    ) as process:
        os.close(theirs)
        while True:
            try:
                part = os.read(mine, 4096)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            shown += part
        out = process.communicate(timeout=30)[0]
    os.close(mine)
    assert process.returncode == 0
    assert b"trial 1 of 7" in shown
    assert b"s of rig time left" in shown
    assert json.loads(out)["trials"] == 7


def test_rigs_and_recipes_are_listed(ffc_id: Program) -> None:
    done = ffc_id("rigs")
    assert done.returncode == 0
    for word in ("sim:paper", "sim:bench", "sim:FILE.toml", "dynamixel:DEVICE[,id=N]", "feetech:DEVICE"):
        assert word in done.stdout
    assert set(json.loads(ffc_id("rigs", "--json").stdout)["rigs"]) == {
        "sim:paper",
        "sim:bench",
        "sim:sts3215",
    }
    for arguments in (["recipes"], ["recipes", "list"]):
        listed = ffc_id(*arguments)
        assert [line.split()[0] for line in listed.stdout.splitlines()] == [
            "gravity",
            "pauses",
            "sine",
            "sweep",
            "validation",
        ]
        assert set(json.loads(ffc_id(*arguments, "--json").stdout)["recipes"]) >= {"gravity"}
    assert ffc_id("recipes", "show", "sweep").stdout == recipe_text("sweep")
