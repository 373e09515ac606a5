"""The one place that compiles: the decorators that every kernel wears.

numba is imported, and a kernel compiled, when Python first calls one: geometry that is only read stays plain Python. The
compiled code is kept in a cache. numba's cache does not see that a kernel in another file has changed, so the cache folder
is named after a hash of all kernel sources, and an edit anywhere gives a new folder. ``fastmath`` stays off: it turns
isfinite(nan) into True. Kernels do not own memory (``_nrt=False``), so none can allocate, and passing a part of an array on
costs no reference counting, which was nearly half of a step.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Callable
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
KERNEL_FOLDERS = ("physics", "chain", "estimate")
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
COMPILING = "compiling the model, about half a minute; done once for this version and kept in %s"


def _source_hash() -> str:
    """Hash of every kernel source, 16 hex digits."""
    digest = hashlib.sha256()
    for folder in KERNEL_FOLDERS:
        for path in sorted((ROOT / folder).glob("*.py")):
            digest.update(path.name.encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Where compiled kernels of this source state are kept: NUMBA_CACHE_DIR, or a folder of our own."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return Path(os.environ["NUMBA_CACHE_DIR"])
    home = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return home / "boom_twin" / _source_hash()


@cache
def _numba() -> Any:
    """numba, its cache pointed at our folder; says so if that is empty."""
    folder = cache_folder()
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    import numba

    numba.config.CACHE_DIR = str(folder)
    if not numba.config.DISABLE_JIT and not any(folder.glob("**/*.nbi")):
        logging.getLogger("boom_twin").warning(COMPILING, folder)
    return numba


def _cache(function: Callable[..., Any]) -> Any:
    """A cache on disk that loads compiled code without first filling numba's tables of types and of BLAS.

    Filling them takes 0.25 s, most of it an import of scipy.linalg, and only compiling needs them: it fills them itself.
    """
    from numba.core.caching import FunctionCache
    from numba.core.runtime import rtsys

    class Quick(FunctionCache):  # type: ignore[misc]
        def load_overload(self, sig: Any, target_context: Any) -> Any:
            rtsys.initialize(target_context)  # the symbols that loaded code refers to
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)

    return Quick(function)


class Kernel:
    """A function that is compiled when Python first calls it, or when a kernel that calls it is compiled."""

    _cached = True

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options

    @cached_property
    def dispatcher(self) -> Any:
        """numba's object, made on first use."""
        dispatcher = _numba().njit(**OPTIONS, **self._options)(self.py_func)
        if self._cached and hasattr(dispatcher, "enable_caching"):  # not where numba is told not to compile
            dispatcher._cache = _cache(self.py_func)
        return dispatcher

    @property
    def _numba_type_(self) -> Any:
        """What numba takes this object for when it meets it in a kernel."""
        return self.dispatcher._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)


class Inner(Kernel):
    """A kernel that exists compiled only inside others; called from Python it runs as Python."""

    _cached = False

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def kernel(function: Callable[..., Any]) -> Kernel:
    """Compile `function`: nopython, cached on disk, without the interpreter's lock, no exceptions for division."""
    return Kernel(function)


def inner(function: Callable[..., Any]) -> Inner:
    """Compile as `kernel` does, inlined wherever a kernel calls it; Python runs it as it stands."""
    return Inner(function, forceinline=True, no_cpython_wrapper=True)
