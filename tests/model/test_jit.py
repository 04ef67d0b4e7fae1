"""Formulas that are compiled already are loaded without numba's compiler, and compiled where they are not."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

#: Reading a motion and one differentiation touch what a fit compiles.
_FIT = """
import json, sys
import numpy as np
from idtool.fit.eliminate import filtered_moments
from idtool.model import lugre
from idtool.signals import smoother
ones, first, t = np.ones(60), np.arange(60) == 0, 0.01 * np.arange(60)
z, decay = lugre.propagate(ones, ones, ones, first, np.zeros(1))
slopes = np.zeros((lugre.BLOCK, 60))
lugre.propagate_blocks(ones, ones, ones, first, np.zeros(1))[2](slopes + 1.0, ones, slopes)
each = np.arange(61, dtype=np.int32)
products = filtered_moments(
    np.outer(z, np.arange(1.0, 5.0)), ones, each[:60], each, np.outer(z, [3.0]), np.array([0, 60])
)
motion = smoother.smooth(t, np.sin(t), np.cos(t), first)
told = [float(np.sum(part)) for part in (z, decay, slopes, products)]
print(json.dumps([told, sorted(name for name in sys.modules if name.startswith("numba."))]))
"""


def _run(cache: Path) -> tuple[list[float], set[str]]:
    done = subprocess.run(
        [sys.executable, "-c", _FIT],
        env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        check=True,
    )
    told, modules = json.loads(done.stdout)
    return told, set(modules)


def test_a_second_process_loads_no_compiler(tmp_path: Path) -> None:
    compiled, compiling = _run(tmp_path)
    loaded, loading = _run(tmp_path)
    assert loaded == pytest.approx(compiled, rel=1e-15)
    registries = {"numba.np.arraymath", "numba.core.inline_closurecall"}
    assert registries <= compiling
    assert registries.isdisjoint(loading)


#: A formula that was kept, then one that is compiled anew around it.
_AROUND = """
import json
import numpy as np
from idtool.model.jit import jit
from idtool.model.running import _medians
kept = _medians(np.array([1.0, 5.0, 2.0, 4.0]), np.array([1.0, 2.0, 5.0]))
@jit()
def twice(padded, window):
    return 2.0 * _medians(padded, window)
print(json.dumps([kept.tolist(), twice(np.array([1.0, 5.0, 2.0, 4.0]), np.array([1.0, 2.0, 5.0])).tolist()]))
"""


def test_what_was_kept_can_be_built_into_what_is_compiled(tmp_path: Path) -> None:
    script = tmp_path / "around.py"
    for run in range(2):
        script.write_text(_AROUND + f"# {run}: compiled anew\n")
        done = subprocess.run(
            [sys.executable, str(script)],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=True,
        )
        assert json.loads(done.stdout) == [[2.0, 4.0], [4.0, 8.0]]
    kept = list((tmp_path / "cache").rglob("*.nbc"))
    assert kept
    assert not any(b"idtool.model.jit" in file.read_bytes() for file in kept)  # numba alone can read them


#: After functions of this package were loaded numba is as it was for those of others.
_AFTER = """
import json
import numba
import numpy as np
from numba.core import environment
from numba.core.registry import cpu_target
before = environment._rebuild_env
from idtool.model.running import _medians
_medians(np.array([1.0, 5.0, 2.0, 4.0]), np.array([1.0, 2.0, 5.0]))
library = cpu_target.target_context.codegen()._library_class
hits = sum(_medians.stats.cache_hits.values())
print(json.dumps([environment._rebuild_env is before, library.__module__, hits]))
"""


def test_numba_is_left_as_it_was(tmp_path: Path) -> None:
    for hits in (0, 1):
        done = subprocess.run(
            [sys.executable, "-c", _AFTER],
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=True,
        )
        assert json.loads(done.stdout) == [True, "numba.core.codegen", hits]
