"""Compile kernels with numba, or run them as plain Python for debugging.

numba is imported, and a kernel compiled, when Python first calls one: geometry that is only read stays plain Python. The
compiled code is kept on disk, see `boom_twin.kernels.compiled_cache`. ``fastmath`` stays off: it turns isfinite(nan) into
True. Kernels do not own memory (``_nrt=False``), so none can allocate, and passing a part of an array on costs no reference
counting, which was nearly half of a step.
"""

from __future__ import annotations

import logging
import os
import struct
from collections.abc import Callable, Sequence
from functools import cache, cached_property, update_wrapper
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from ..errors import UsageError
from .compiled_cache import NO_COLOURS, SUFFIX, KernelCache, cache_folder, claim, fault_of

Fields = TypeVar("Fields")

OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
COMPILING = "compiling the model, about a minute; done once for this version and kept in %s"
NOT_KEPT = "compiling the model, about a minute each time, because compiled code is not kept: %s"
LAYOUT = 0x1 | 0x2 | 0x100 | 0x400
"""Flags of an array that its type depends on: C and Fortran order, aligned, writeable."""
CONFIG_FILE = ".numba_config.yaml"
"""numba takes its settings from this file in the working directory, which may be a received session's."""
ARRAY = ("meminfo", "parent", "nitems", "itemsize", "data", "shape", "strides")  # parts of an array in numba's order
_LAYOUTS = dict[Any, object]()  # one object for each layout of a `Referenced` tuple


class Referenced:
    """Base of named tuples that kernels take by reference: by the address of a table of their fields.

    Python writes the table once. Compiled code reads a field there, see `boom_twin.kernels.references`. What the arrays of a
    tuple hold may change. A copy of a tuple has a table of its own.
    """

    @cached_property
    def address(self) -> int:
        """Address of the table in memory."""
        layout, numbers = _packed(tuple(cast("tuple[Any, ...]", self)))
        table = np.frombuffer(struct.pack(layout, *numbers), np.uint8)
        return int(self.__dict__.setdefault("_table", table).ctypes.data)  # of two threads, both take the first one's

    @cached_property
    def layout(self) -> object:
        """An object that all tuples with the same types of fields have in common."""
        return _LAYOUTS.setdefault((type(self), *map(_kind, cast("tuple[Any, ...]", self))), object())

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(cast("tuple[Any, ...]", self))


def by_reference(kind: type[Fields]) -> type[Fields]:
    """Return the class of named tuples with the base `Referenced`."""
    names = {name: getattr(kind, name) for name in ("__module__", "__qualname__", "__doc__")}
    return cast("type[Fields]", type(kind.__name__, (Referenced, kind), names))


def _packed(value: Any) -> tuple[str, Sequence[Any]]:
    """Return a value as compiled code has it in memory, eight bytes a number: a format of `struct`, and the numbers."""
    if isinstance(value, np.ndarray):  # see `ARRAY`
        return f"{5 + 2 * value.ndim}q", (0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
    if isinstance(value, Referenced):
        return "q", [value.address]
    if isinstance(value, tuple):
        layouts, numbers = zip(*map(_packed, value), strict=True)
        return "".join(layouts), [number for each in numbers for number in each]
    return "d" if isinstance(value, float) else "q", [value]


def _kind(value: Any) -> Any:
    """Return all that numba's type of an argument depends on, fifty times as fast as that type."""
    if isinstance(value, np.ndarray):
        return type(value), value.dtype, value.ndim, value.flags.num & LAYOUT
    if not isinstance(value, tuple):
        return type(value)
    return value.layout if isinstance(value, Referenced) else (type(value), *map(_kind, value))


@cache
def _numba() -> Any:
    """numba, with its settings from the environment only."""
    if Path(CONFIG_FILE).exists():
        file = Path(CONFIG_FILE).absolute()
        raise UsageError(f"{file}: would change how the model is compiled. Move it away, or start elsewhere.")
    # numba words an error for every signature that it tries; where colorama is installed, colours take a twentieth of compiling
    os.environ.setdefault(NO_COLOURS, "1")
    import numba

    from . import references  # noqa: F401  # makes its type known to numba

    return numba


@cache
def _folder() -> Path | None:
    """Return the folder of compiled kernels, None if there is none; log a warning if there is none or it is empty."""
    folder = cache_folder()
    if (fault := fault_of(folder)) is not None:
        _tell_not_kept(fault)
        return None
    if not any(folder.glob(f"*{SUFFIX}")):
        logging.getLogger("boom_twin").warning(COMPILING, folder)
    claim(folder)
    return folder


@cache
def _tell_not_kept(reason: str) -> None:
    logging.getLogger("boom_twin").warning(NOT_KEPT, reason)


class Kernel:
    """A function that is compiled when Python first calls it, or when a kernel that calls it is compiled."""

    _compiler, _cached = "KernelCompiler", True  # of `boom_twin.kernels.inlining`

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options
        self._compiled: dict[Any, Callable[..., Any]] = {}

    @cached_property
    def dispatcher(self) -> Any:
        """numba's object, made on first use."""
        numba = _numba()
        from . import inlining

        dispatcher = numba.njit(pipeline_class=getattr(inlining, self._compiler), **OPTIONS, **self._options)(self.py_func)
        if self._cached and not numba.config.DISABLE_JIT and (folder := _folder()) is not None:
            try:
                dispatcher._cache = KernelCache(self.py_func, folder)
            except (ImportError, AttributeError) as error:
                _tell_not_kept(f"numba {numba.__version__} is not the one that was tested ({error})")
        return dispatcher

    @cached_property
    def _numba_type_(self) -> Any:
        from .inlining import CalledKernel

        return CalledKernel(self.dispatcher)

    def __call__(self, *arguments: Any) -> Any:
        kinds = tuple(map(_kind, arguments))
        if (code := self._compiled.get(kinds)) is None:
            code = self._compiled[kinds] = self._code_for(arguments)
        return code(*arguments)

    def _code_for(self, arguments: tuple[Any, ...]) -> Callable[..., Any]:
        """Return the machine code for arguments of these types; the function itself if numba is switched off.

        A boom's tables have a hundred fields. numba's dispatcher looks at all of them, in 10 to 20 us of every call.
        """
        dispatcher = self.dispatcher
        if not hasattr(dispatcher, "overloads"):
            return self.py_func
        types = tuple(map(dispatcher.typeof_pyval, arguments))
        dispatcher.compile(types)
        return cast("Callable[..., Any]", dispatcher.overloads[types].entry_point)


class Inner(Kernel):
    """A kernel that exists compiled only inside others; called from Python it runs as Python."""

    _compiler, _cached = "InlinedCompiler", False

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def kernel(function: Callable[..., Any]) -> Kernel:
    """Compile `function`: nopython, cached on disk, without the interpreter's lock, no exceptions for division."""
    return Kernel(function)


def inner(function: Callable[..., Any]) -> Inner:
    """Compile as `kernel` does, inlined wherever a kernel calls it; Python runs it as it stands."""
    return Inner(function, forceinline=True, no_cpython_wrapper=True)
