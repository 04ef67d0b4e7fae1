"""What commands without a report leave unloaded: the slow part of a short command is its imports."""

from __future__ import annotations

import json
import platform
import subprocess
import sys
from pathlib import Path

import pytest

_SESSION = Path(__file__).resolve().parents[2] / "data" / "session"
#: Each takes tenths of a second to import; no command below draws, fills a page or needs its tests.
_HEAVY = ("matplotlib", "scipy.stats", "scipy.signal", "scipy.interpolate", "jinja2", "distributed", "h5py")
#: What moves a rig or reads a file needs no optimiser either.
_OF_A_FIT = ("scipy.optimize", "nlopt", "idtool.fit", "idtool.diagnosis")
_SCRIPT = """
import contextlib, io, json, sys
from idtool.cli.main import main
told = []
for words in json.load(sys.stdin):
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            main(words)
        except SystemExit as end:
            told.append([words[0], end.code, sorted(sys.modules)])
json.dump(told, sys.stdout)
"""


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """Modules of one process after each of a row of commands, from the lightest to the heaviest."""
    folder = tmp_path_factory.mktemp("imports")
    gravity, sweep, sine = (str(_SESSION / f"{name}.csv.gz") for name in ("gravity", "sweep", "sine"))
    recipe = folder / "short.toml"
    recipe.write_text(
        'schema = "ffc-id/recipe/1"\nname = "short"\nexperiment = "sine"\nperiod_s = 0.01\n[[trials]]\n'
        'kind = "sine"\nfrequency_hz = 0.5\namplitude_rad_s = 0.6\nduration_s = 4.0\n'
    )
    commands = [
        ["--help"],
        ["import", gravity, "-o", "log.csv"],
        ["rigs"],
        ["recipes"],
        ["run", "--recipe", str(recipe), "--rig", "sim:paper", "-o", "run.csv"],
        ["check", gravity],
        ["fit-gravity", gravity, "-p", "params.toml"],
        ["fit-static", sweep, "-p", "params.toml", "--friction", "coulomb"],
        ["fit-dynamic", sine, "-p", "params.toml"],
        ["predict", sine, "-p", "params.toml", "-o", "out.csv"],
    ]
    return _modules(commands, folder)


def _modules(commands: list[list[str]], folder: Path) -> dict[str, set[str]]:
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT],
        input=json.dumps(commands),
        capture_output=True,
        text=True,
        cwd=folder,
    )
    told = json.loads(done.stdout)
    assert [(name, code) for name, code, _ in told] == [(words[0], 0) for words in commands], done.stderr
    return {name: set(modules) for name, _, modules in told}


@pytest.mark.parametrize(
    "command",
    [
        "--help",
        "import",
        "rigs",
        "recipes",
        "run",
        "check",
        "fit-gravity",
        "fit-static",
        "fit-dynamic",
        "predict",
    ],
)
def test_a_command_without_a_figure_loads_nothing_that_draws_or_tests(
    loaded: dict[str, set[str]], command: str
) -> None:
    assert loaded[command].isdisjoint(_HEAVY)


@pytest.mark.parametrize("command", ["--help", "import", "rigs", "recipes", "run"])
def test_what_reads_or_moves_loads_no_optimiser(loaded: dict[str, set[str]], command: str) -> None:
    assert loaded[command].isdisjoint(_OF_A_FIT)


def test_help_loads_no_numbers(loaded: dict[str, set[str]]) -> None:
    assert loaded["--help"].isdisjoint({"numpy", "pandas", "numba", "rich"})


def test_a_fit_loads_no_frame_no_library_of_searches_no_verb_and_no_rig(tmp_path: Path) -> None:
    gravity, sweep, sine = (str(_SESSION / f"{name}.csv.gz") for name in ("gravity", "sweep", "sine"))
    commands = [
        ["fit-gravity", gravity, "-p", "params.toml"],
        ["fit-static", sweep, "-p", "params.toml"],
        ["fit-dynamic", sine, "-p", "params.toml"],
        ["fit-motion", sine, "-p", "motion.toml"],
    ]
    loaded = _modules(commands, tmp_path)
    modules = loaded["fit-dynamic"]
    assert {"idtool.fit", "idtool.signals.bounded", "idtool.diagnosis.remainder"} <= modules
    libraries = {"pandas", "scipy.special", "scipy.ndimage", "scipy.sparse", "scipy.linalg"}
    rooms = {"idtool.verbs", "idtool.diagnosis.diagnose", "idtool.rig", "idtool.experiment"}
    assert modules.isdisjoint(libraries | rooms)
    assert loaded["fit-motion"].isdisjoint(libraries | {"scipy.optimize"})


def test_check_loads_no_frame_and_no_library_of_searches(tmp_path: Path) -> None:
    modules = _modules([["check", str(_SESSION / "gravity.csv.gz")]], tmp_path)["check"]
    assert "idtool.signals.bounded" in modules
    assert modules.isdisjoint({"pandas", "scipy.special", "scipy.linalg"})


_ARRAYS = """
import resource
import numpy as np
from idtool.cli import main
{}
for _ in range(200):
    [np.ones(40_000) for _ in range(12)]
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library keeps memory its own way")
def test_arrays_that_are_let_go_are_used_again() -> None:
    """glibc gave them back to the system, and every array of a fit was new memory."""
    kept, given_back = (
        int(
            subprocess.run(
                [sys.executable, "-c", _ARRAYS.format(line)], capture_output=True, check=True
            ).stdout
        )
        for line in ("main._keep_memory()", "")
    )
    assert kept < 0.7 * given_back
