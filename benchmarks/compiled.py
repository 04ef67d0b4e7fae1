"""lugre.c through ctypes, called with the arrays of `idtool.model.lugre`."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SOURCE = Path(__file__).with_name("lugre.c")
PLAIN = ("-O3",)
FAST = ("-O3", "-march=native", "-ffast-math")
LANES = 16


def compiler() -> str | None:
    """The C compiler: `CC`, else `cc`; None where there is none."""
    wanted = os.environ.get("CC", "cc")
    return wanted if shutil.which(wanted) else None


class Library:
    """The functions of lugre.c, compiled with some flags."""

    def __init__(self, folder: Path, flags: tuple[str, ...]) -> None:
        cc, name = compiler() or "cc", f"lugre{'_'.join(flags)}"
        compiled, file = str(folder / f"{name}.o"), str(folder / f"{name}.so")
        # linked without the flags: -ffast-math there would make the whole process flush small numbers to zero
        for command in (
            [cc, *flags, "-fPIC", "-c", str(_SOURCE), "-o", compiled],
            [cc, "-shared", compiled, "-o", file, "-lm"],
        ):
            subprocess.run(command, check=True, capture_output=True)
        self._library = ctypes.CDLL(file)

    def propagate(
        self, velocity: Array, step: Array, rho: Array, first: NDArray[np.bool_], start: Array, *, split: bool
    ) -> tuple[Array, Array]:
        """As `idtool.model.lugre.propagate`; with `split` the exponentials come first, in their own loop."""
        z, decay = np.empty(len(velocity)), np.empty(len(velocity))
        call = self._library.lugre_split if split else self._library.lugre
        call(_count(velocity), *map(_pointer, (velocity, step, rho, first, start, z, decay)))
        return z, decay

    def propagate_tangents(
        self,
        velocity: Array,
        step: Array,
        rho: Array,
        first: NDArray[np.bool_],
        start: Array,
        dlog_rho: Array,
    ) -> tuple[Array, Array, Array]:
        """As `benchmarks.kernel.tangents`."""
        z, decay = np.empty(len(velocity)), np.empty(len(velocity))
        kept, sensitivity, tangents = np.empty_like(z), np.empty_like(z), np.empty_like(dlog_rho)
        arrays = (velocity, step, rho, first, start, dlog_rho, kept, sensitivity, z, decay, tangents)
        count = ctypes.c_int64(len(dlog_rho))
        self._library.lugre_tangents(_count(velocity), count, *map(_pointer, arrays))
        return z, decay, tangents

    def many(
        self, velocity: Array, step: Array, level: Array, first: NDArray[np.bool_], stiffness: Array
    ) -> Array:
        """Deflections of `LANES` stiffnesses at once, starts at 0, shape (rows, LANES)."""
        z = np.empty((len(velocity), LANES))
        arrays = (velocity, step, 1.0 / level, first, stiffness, z)
        self._library.lugre_many(_count(velocity), *map(_pointer, arrays))
        return z


def _count(values: Array) -> ctypes.c_int64:
    return ctypes.c_int64(len(values))


def _pointer(values: NDArray[np.generic]) -> ctypes.c_void_p:
    return ctypes.c_void_p(values.ctypes.data)
