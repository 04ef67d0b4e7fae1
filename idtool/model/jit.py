"""How a formula is compiled: by numba, whose machine code is kept beside the source and loaded at once.

Before numba loads the first function that it kept, it sets up everything that compiling could need (200
modules, scipy.linalg among them: 0.2 s) and compiles what counts who holds an array; with each function it
reads what others could inline of it, and imports the modules whose code it was made of. What is kept is
compiled already and needs none of that; where something is compiled after all, numba's compiler sets itself
up, and reads what it inlines. This leans on the inside of numba: `tests/model/test_jit.py` holds it to that.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
from numba.core import environment
from numba.core.caching import FunctionCache, make_library_cache
from numba.core.codegen import JITCodeLibrary
from numba.core.runtime import nrtdynmod
from numba.core.runtime.nrt import rtsys

F = TypeVar("F", bound=Callable[..., Any])


class _Library(JITCodeLibrary):
    """numba's machine code of a function; of one that was kept, what others could inline is read when one
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


# what is kept names numba's own, so that who has this package no longer can read it
_rebuild_env.__module__ = environment.__name__
environment._rebuild_env = _rebuild_env


class _Loading:
    """A cache of numba's, which loads without setting the compiler up."""

    def load_overload(self: Any, sig: Any, target_context: Any) -> Any:
        target_context.codegen()._library_class = _Library
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


class _Kept(_Loading, FunctionCache):
    """Of a function."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        rtsys.initialize(target_context)  # memory of arrays that compiled code makes
        return super().load_overload(sig, target_context)


class _KeptMemory(_Loading, make_library_cache("memory")):  # type: ignore[misc]
    """Of what counts who holds an array."""


def _memory(target_context: Any) -> Any:
    """What counts who holds an array: numba would compile it in every process (0.02 s)."""
    cache = _KeptMemory(_memory)
    library = cache.load_overload((), target_context)
    if library is None:
        code, library = nrtdynmod.create_nrt_module(target_context)  # type: ignore[no-untyped-call]
        library.enable_object_caching()
        library.add_ir_module(code)
        library.finalize()
        cache.save_overload((), library)
    return library


nrtdynmod.compile_nrt_functions = _memory


def jit(**options: Any) -> Callable[[F], F]:
    """`numba.njit` with its cache; `options` are its own. The function itself under NUMBA_DISABLE_JIT."""

    def decorate(function: F) -> F:
        kernel: Any = numba.njit(**options)(function)
        if hasattr(kernel, "enable_caching"):
            kernel._cache = _Kept(function)  # type: ignore[no-untyped-call]
        return kernel  # type: ignore[no-any-return]

    return decorate
