"""What the program does about a fault of its own: one sentence, a file with the details, exit code 70."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from idtool.cli.main import main

from idtool import Log
from idtool.errors import InputError
from idtool.signals import record
from testbench.fleet import session

from .support import ffc_id

Break = Callable[[Callable[[], Any]], tuple[int, str]]


@pytest.fixture
def broken(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Break:
    """`ffc-id check` in which something happens that never should: its exit code and what it says."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def run(happens: Callable[[], Any]) -> tuple[int, str]:
        monkeypatch.setattr(Log, "read", lambda *_, **__: happens())
        with pytest.raises(SystemExit) as stop:
            main(["check", "sine.csv"])
        printed = capsys.readouterr()
        assert printed.out == ""
        assert printed.err.count("\n") == 1
        return int(stop.value.code or 0), printed.err

    return run


def test_a_fault_is_one_sentence_and_a_file(broken: Break, tmp_path: Path) -> None:
    def fails() -> NoReturn:
        raise ZeroDivisionError("by zero,\nof all things")

    code, told = broken(fails)
    (file,) = tmp_path.glob("ffc-id-fault-*.txt")
    assert (code, told) == (
        70,
        "ffc-id: the program has a fault (ZeroDivisionError: by zero, of all things); please report it with "
        f"the details, which are in {file}.\n",
    )
    details = file.read_text()
    assert "Traceback (most recent call last)" in details
    assert "in fails" in details
    assert details.startswith("ffc-id ")
    assert file.stat().st_mode & 0o077 == 0


def test_where_no_file_can_be_written(broken: Break, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", "/proc")
    code, told = broken(lambda: [][0])
    assert code == 70
    assert told.startswith(
        "ffc-id: the program has a fault (IndexError: list index out of range), and no file"
    )


def test_an_interrupt_that_a_library_made_its_own_error(broken: Break) -> None:
    def library() -> NoReturn:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        except KeyboardInterrupt as error:
            raise RuntimeError("callback failed") from error
        raise AssertionError("the signal was not heard")

    before = signal.getsignal(signal.SIGTERM)
    assert broken(library) == (130, "interrupted.\n")
    assert signal.getsignal(signal.SIGTERM) is before


def test_an_ignored_signal_stays_ignored(broken: Break) -> None:
    """As `nohup` asks."""

    def hangs_up() -> NoReturn:
        os.kill(os.getpid(), signal.SIGHUP)
        raise InputError("went on")

    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        assert broken(hangs_up) == (3, "ffc-id: went on.\n")
    finally:
        signal.signal(signal.SIGHUP, before)


def test_warnings_of_libraries_are_not_for_users(tmp_path: Path) -> None:
    """numpy's name a file and a line of ours."""
    session(tmp_path / "one")
    program = (
        "import numpy as np, idtool.log as log; read = log.Log.read\n"
        "log.Log.read = lambda *a, **k: (np.array([1e300]) * 1e300, read(*a, **k))[1]\n"
        "from idtool.cli.main import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "check", "one/sine.csv"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "next: ffc-id identify one/sine.csv -o result\n")
    assert "sine.csv" in done.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_output_that_fills_the_disk() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-c", "from idtool.cli.main import main; main()", "recipes"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
        )
    assert done.returncode == 3
    assert done.stderr == (
        "ffc-id: standard output cannot be written (No space left on device); free space or pick another "
        "place.\n"
    )


@pytest.mark.parametrize("words", [("report",), ("fit-static", "no.csv", "-p")], ids=" ".join)
def test_a_name_that_is_too_long(tmp_path: Path, words: tuple[str, ...]) -> None:
    log = session(tmp_path / "one") / "sine.csv"
    done = ffc_id(*(str(log) if word == "no.csv" else word for word in words), "x" * 300, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.endswith("xxx: File name too long; name another place.\n")
    assert len(done.stderr) < 130


@pytest.mark.parametrize("column", ["time_s", "position_rad", "velocity_rad_s", "torque_nm"])
@pytest.mark.parametrize(
    ("factor", "said"), [(1e300, "which no axis reaches; check its unit"), (1e-300, "which no sensor sees")]
)
def test_magnitudes_that_no_axis_has(tmp_path: Path, column: str, factor: float, said: str) -> None:
    log = Log.read(session(tmp_path / "one") / "sine.csv")
    log.frame[column] *= factor
    with pytest.raises(InputError, match=f'column "{column}" .* {said}'):
        record([log])


def test_large_torques_whose_sum_is_infinite(tmp_path: Path) -> None:
    log = Log.read(session(tmp_path / "one") / "sine.csv")
    log.frame["torque_nm"] = 1e308 * np.sign(log.frame["torque_nm"])
    with pytest.raises(InputError, match=r"is about 1e\+308"):
        record([log])


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_an_axis_that_stands(
    tmp_path: Path, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    log = Log.read(session(tmp_path / "one") / "sine.csv")
    log.frame["velocity_rad_s"] = 0.0
    log.frame["position_rad"] = 0.3
    log.write("still.csv")
    more = []
    if command == "diagnose":
        (tmp_path / "p.toml").write_text(
            'schema = "ffc-id/params/1"\n[axis]\nkind = "rotary"\n[friction.static]\n'
            "coulomb_nm = {value = 0.08}\nstatic_nm = {value = 0.1}\n"
            "stribeck_velocity_rad_s = {value = 0.1}\nviscous_nm_s_per_rad = {value = 0.1}\n"
        )
        more = ["-p", "p.toml"]
    with pytest.raises(SystemExit) as stop:
        main([command, "still.csv", "-o", "result", *more])
    assert stop.value.code == 3
    assert capsys.readouterr().err.startswith(
        'ffc-id: still.csv: columns "position_rad" and "velocity_rad_s" never change: the axis was held'
    )
