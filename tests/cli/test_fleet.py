"""`ffc-id fleet`: the real program, its words, exit codes and files."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from testbench.fleet import session
from tests.fleet.doubles import broken

from .support import PROGRAM, ffc_id

QUICK = ("--friction", "coulomb", "--gravity", "none", "--without", "hysteresis", "--without", "backlash")


def test_a_fleet_with_a_bad_session(tmp_path: Path) -> None:
    for k in range(2):
        session(tmp_path / "sessions" / f"A{k}_2026-01-01", seed=k)
    broken(tmp_path / "sessions" / "bad")
    done = ffc_id("fleet", "sessions", "-o", "out", *QUICK, "--again", cwd=tmp_path)
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
    assert "[3/3]" in done.stderr
    assert "failed: bad/sine.csv: needs a column" in done.stdout
    assert done.stdout.endswith("2 of 3 sessions; page: out/fleet.html\n")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "fleet.html",
        "sessions",
        "summary.csv",
        "summary.json",
        "summary.parquet",
    ]
    again = ffc_id("fleet", "sessions", "-o", "out", *QUICK, "--json", "-q", cwd=tmp_path)
    assert (again.returncode, again.stderr) == (3, "")
    document = json.loads(again.stdout)
    assert document == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert document["failed"] == ["bad"]
    following = done.stderr.splitlines()[-1].removeprefix("next: ffc-id fleet ").split()
    # with its options, or every session would be done again
    pairs = ["-o out", "--friction coulomb", "--gravity none", "--without hysteresis", "--without backlash"]
    assert following[0] == "sessions"
    assert {" ".join(following[k : k + 2]) for k in range(1, len(following), 2)} == set(pairs)
    shutil.rmtree(tmp_path / "sessions" / "bad")
    mended = ffc_id("fleet", "sessions", "-o", "out", *QUICK, cwd=tmp_path)
    assert mended.returncode == 0
    following = mended.stderr.splitlines()[-1].removeprefix("next: ffc-id compare ").split()
    assert [Path(file).parent.name for file in following] == ["A0_2026-01-01", "A1_2026-01-01"]
    assert all((tmp_path / file).exists() for file in following)
    page = ffc_id("report", "out/sessions/A0_2026-01-01", cwd=tmp_path)
    assert page.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "code", "expected"),
    [
        (["absent", "-o", "out"], 3, "ffc-id: absent: no such folder; name the folder"),
        (["sessions", "-o", "sessions"], 3, "is the folder of sessions itself"),
        (["sessions", "-o", "out", "-j", "0"], 2, "0 is not in the range"),
        (["sessions", "-o", "out", "-j", "2", "--scheduler", "x"], 2, "give one of them;"),
        (["sessions"], 2, "Missing option '-o'"),
    ],
)
def test_refusals(tmp_path: Path, arguments: list[str], code: int, expected: str) -> None:
    session(tmp_path / "sessions" / "A")
    done = ffc_id("fleet", *arguments, cwd=tmp_path)
    assert done.returncode == code
    assert expected in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_silent_scheduler_is_given_up_before_anything_slow_is_imported(tmp_path: Path) -> None:
    session(tmp_path / "sessions" / "A")
    program = (
        "import atexit, sys, idtool.fleet.scheduler as scheduler; scheduler.PATIENCE_S = 1.0\n"
        "atexit.register(lambda: print('pandas' in sys.modules))\n"
        "from idtool.cli.main import main; main()"
    )
    with socket.create_server(("127.0.0.1", 0)) as silent:
        mute = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        done = subprocess.run(
            [sys.executable, "-c", program, "fleet", "sessions", "-o", "out", "--scheduler", mute],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    assert (done.returncode, done.stdout) == (3, "False\n")
    assert f"no Dask scheduler answers at {mute}" in done.stderr


@pytest.mark.parametrize(
    ("end", "number"),
    [
        (os.killpg, signal.SIGINT),
        (os.kill, signal.SIGTERM),
        pytest.param(os.killpg, signal.SIGHUP, marks=pytest.mark.long),
    ],
)
def test_a_signal_ends_it_and_its_processes(
    tmp_path: Path, end: Callable[[int, int], None], number: signal.Signals
) -> None:
    for k in range(6):
        session(tmp_path / "sessions" / f"A{k}", seed=k)
    arguments = [str(PROGRAM), "fleet", "sessions", "-o", "out", "-j", "1", *QUICK]
    process = subprocess.Popen(
        arguments,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    first = tmp_path / "out" / "sessions" / "A0" / "session.json"
    while not first.exists() and process.poll() is None:
        time.sleep(0.05)
    end(process.pid, number)
    _, told = process.communicate(timeout=120)  # ends when every process of it has let go of its pipes
    assert process.returncode == 130
    assert "interrupted." in told
    assert "Traceback" not in told
    assert not (tmp_path / "out" / "fleet.html").exists()
