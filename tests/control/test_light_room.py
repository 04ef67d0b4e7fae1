"""What the controller loads: numpy and numba, and of this package the rooms before it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.control.double import parameters

_NUMBA = "import sys, numpy, numba\nnumba.njit(lambda x: x + 1.0)(1.0)\n"
_TOLD = "import json\nprint(json.dumps(sorted(sys.modules)))"
_CONTROLLER = """import sys
from idtool import ForceFreeController, Parameters
controller = ForceFreeController(Parameters.read({file!r}), period_s=0.01)
controller.step(0.0, 0.0, 0.0, payload_kg=0.4)
"""


def loaded(script: str) -> set[str]:
    """The modules that a fresh process holds after a script."""
    done = subprocess.run([sys.executable, "-c", script + _TOLD], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


@pytest.fixture(scope="module")
def modules(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    file = tmp_path_factory.mktemp("light") / "params.toml"
    parameters(hysteresis={"yield": 0.01, "stiffness": 0.5}).write(file)
    return loaded(_CONTROLLER.format(file=str(file)))


def test_nothing_but_numpy_and_numba_is_loaded(modules: set[str]) -> None:
    more = {name.partition(".")[0] for name in modules - loaded(_NUMBA)} - set(sys.stdlib_module_names)
    assert more - {"idtool", "numpy", "numba", "llvmlite"} == set()


def test_of_this_package_only_the_rooms_before_the_controller(modules: set[str]) -> None:
    rooms = {name.split(".")[1] for name in modules if name.startswith("idtool.")}
    assert rooms == {"errors", "io", "model", "effects", "parameters", "control"}


def test_the_package_itself_loads_nothing_and_says_what_it_has() -> None:
    script = "import sys, idtool\nassert 'identify' in dir(idtool) and 'Log' in dir(idtool)\n"
    assert {name for name in loaded(script) if name.startswith("idtool.")} == set()


def test_the_verb_stays_the_function(tmp_path: Path) -> None:
    script = "import idtool.verbs.identify\nfrom idtool import identify\nassert callable(identify)\n"
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
