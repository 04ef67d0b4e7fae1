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
