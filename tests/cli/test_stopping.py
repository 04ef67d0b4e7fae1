"""A signal at a chosen instant, from the first import to the last file: 130, and nothing half-written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from testbench.fleet import session

#: Runs `ffc-id ARGUMENTS` and sends itself a signal at the first audit event of that name whose arguments
#: hold that word (see the table of audit events in the documentation of Python).
PROGRAM = """
import os, sys
number, event, word = int(sys.argv[1]), sys.argv[2], sys.argv[3]
def watch(name, arguments):
    global event
    if name == event and any(word in str(one) for one in arguments[:2]):
        event = None
        os.kill(os.getpid(), number)
sys.addaudithook(watch)
sys.argv[1:] = sys.argv[4:]
from idtool.cli.main import main
main()
"""
QUICK = ("--friction", "coulomb", "--gravity", "none")


def stopped(number: signal.Signals, event: str, word: str, *arguments: str, cwd: Path) -> str:
    """What the program says that was stopped there; checks that it was, and how it ended."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(int(number)), event, word, *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=300,
        check=False,
    )
    assert done.returncode == 130, done.stderr
    assert done.stdout == ""
    return done.stderr


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a log and the result of its identification."""
    return session(tmp_path_factory.mktemp("stopping") / "one")


@pytest.mark.parametrize(
    ("number", "module"),
    [
        (signal.SIGTERM, "click"),
        (signal.SIGHUP, "click"),
        (signal.SIGINT, "click"),
        (signal.SIGTERM, "numpy"),
        (signal.SIGTERM, "pandas"),
        (signal.SIGHUP, "numba"),
        (signal.SIGTERM, "scipy"),
    ],
)
def test_while_modules_are_imported(folder: Path, number: signal.Signals, module: str) -> None:
    told = stopped(number, "import", module, "identify", "sine.csv", "-o", "result", *QUICK, cwd=folder)
    assert told.strip() == "interrupted."
    assert not (folder / "result").exists()


@pytest.mark.parametrize(
    "file",
    [
        "params.toml",
        "report.html",
        *(pytest.param(one, marks=pytest.mark.long) for one in ("diagnosis.json", "evidence.csv.gz")),
    ],
)
def test_while_results_are_written(tmp_path: Path, file: str) -> None:
    """The file at which it was stopped is there whole or not at all; no other is half of itself."""
    session(tmp_path / "one")
    told = stopped(
        *(signal.SIGTERM, "os.rename", f"/{file}", "identify", "one/sine.csv", "-o", "result", *QUICK),
        cwd=tmp_path,
    )
    assert told.strip() == "interrupted."
    assert not list(tmp_path.rglob("*.part"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_while_the_interpreter_ends(number: signal.Signals) -> None:
    """What was printed is printed, and the exit code is the one of the documentation."""
    program = (
        f"import atexit, os; atexit.register(lambda: os.kill(os.getpid(), {int(number)}))\n"
        "from idtool.cli.main import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "recipes", "list", "--json"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (130, "")
    assert json.loads(done.stdout)


def test_no_worker_outlives_a_program_that_is_killed_outright() -> None:
    program = (
        "import os, signal\n"
        "if __name__ == '__main__':\n"
        "    from idtool.fleet.engine import new_process\n"
        "    print(new_process().submit(os.getpid).result(), flush=True)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == -signal.SIGKILL
    worker = int(done.stdout)
    until = time.monotonic() + 20.0
    while alive(worker) and time.monotonic() < until:
        time.sleep(0.05)
    assert not alive(worker)


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


def test_inside_an_optimiser_written_in_c(tmp_path: Path) -> None:
    """The cost that NLopt calls back is where most of the time goes."""
    session(tmp_path / "one")
    program = (
        "import os, idtool.fit.search as s; cost = s._Search.cost\n"
        f"s._Search.cost = lambda *a: (os.kill(os.getpid(), {int(signal.SIGTERM)}), cost(*a))[1]\n"
        "from idtool.cli.main import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "identify", "one/sine.csv", "-o", "result"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=300,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr.strip()) == (130, "", "interrupted.")
    assert not (tmp_path / "result").exists()
