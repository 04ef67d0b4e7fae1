"""How a formula is compiled: by numba, whose machine code is kept beside the source and loaded at once.

Before numba loads the first function that it kept, it sets up everything that compiling could need (200
modules, scipy.linalg among them: 0.2 s), and with each function it reads what others could inline of it, and
imports the modules whose code it was made of. What is kept is compiled already and needs none of that; where
something is compiled after all, numba's compiler sets itself up, and reads what it inlines. This leans on the
inside of numba, and changes it only while a function of this package is loaded: `tests/model/test_jit.py`
holds it to that.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
from numba.core import environment
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., Any])


class _Library(JITCodeLibrary):
    """numba's machine code of a function that was kept; what others could inline of it is read when one
    does."""

    _inlined: bytes | None = None

    @classmethod
    def _unserialize(cls, codegen: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != "object":
            return super()._unserialize(codegen, state)  # type: ignore[no-untyped-call]
        kept = cls(codegen, name)
        code, kept._inlined = data
        kept.enable_object_caching()  # type: ignore[no-untyped-call]
        kept._set_compiled_object(code)  # type: ignore[no-untyped-call]
        kept._finalize_final_module()  # type: ignore[no-untyped-call]
        return kept

    def _get_module_for_linking(self) -> Any:
        if self._inlined is not None:
            self._shared_module, self._inlined = llvm.parse_bitcode(self._inlined), None
            self._codegen._engine._load_defined_symbols(self._shared_module)  # type: ignore[no-untyped-call]
        return super()._get_module_for_linking()  # type: ignore[no-untyped-call]

    def get_pointer_to_function(self, name: str) -> int:
        if self._inlined is None:
            return int(super().get_pointer_to_function(name))  # type: ignore[no-untyped-call]
        return int(self._codegen._engine.get_function_address(name))


def _rebuild_env(module: str, constants: list[Any], name: str) -> Any:
    """The constants of compiled code, as numba's function of that name rebuilds them, without importing the
    module whose names they stand beside: only code that is not compiled looks one up."""
    known = environment.lookup_environment(name)  # type: ignore[no-untyped-call]
    if known is None:
        known = environment.Environment({"__name__": module})
        known.consts[:] = constants
        known.env_name = name
        environment.Environment._memo[name] = known
    return known


@contextmanager
def _lightly(codegen: Any) -> Iterator[None]:
    """Load what was kept as above; other packages' functions are loaded as ever, before and after."""
    rebuild, library = environment._rebuild_env, codegen._library_class
    environment._rebuild_env, codegen._library_class = _rebuild_env, _Library
    try:
        yield
    finally:
        environment._rebuild_env, codegen._library_class = rebuild, library


class _Kept(FunctionCache):
    """numba's cache, which loads without setting the compiler up."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)  # memory of arrays that compiled code makes
        with self._guard_against_spurious_io_errors(), _lightly(target_context.codegen()):
            return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]


def jit(**options: Any) -> Callable[[F], F]:
    """`numba.njit` with its cache; `options` are its own. The function itself under NUMBA_DISABLE_JIT."""

    def decorate(function: F) -> F:
        kernel: Any = numba.njit(**options)(function)
        if hasattr(kernel, "enable_caching"):
            kernel._cache = _Kept(function)  # type: ignore[no-untyped-call]
        return kernel  # type: ignore[no-any-return]

    return decorate
