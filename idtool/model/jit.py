"""How a formula is compiled: by numba, whose machine code is kept beside the source and loaded at once.

Before numba loads the first function that it kept, it sets up everything that compiling could need (200
modules, scipy.linalg among them: 0.2 s). What is kept is compiled already and needs none of that; where
something is compiled after all, numba's compiler sets itself up.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., Any])


class _Kept(FunctionCache):
    """numba's cache, which loads without setting the compiler up."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)  # memory of arrays that compiled code makes
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]


def jit(**options: Any) -> Callable[[F], F]:
    """`numba.njit` with its cache; `options` are its own. The function itself under NUMBA_DISABLE_JIT."""

    def decorate(function: F) -> F:
        kernel: Any = numba.njit(cache=True, **options)(function)
        if hasattr(kernel, "enable_caching"):
            kernel._cache = _Kept(function)  # type: ignore[no-untyped-call]
        return kernel  # type: ignore[no-any-return]

    return decorate
