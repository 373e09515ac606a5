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
from threading import Lock
from typing import Any, TypeVar

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
_BY_REFERENCE: set[type] = set()
_UNREGISTERED: list[type] = []
_REGISTERING = Lock()
_NEWEST = dict[int, Any]()  # what `hold` returned, by the identity of its argument
MOST_HELD = 16


def by_reference(kind: type[Fields]) -> type[Fields]:
    """Let kernels take named tuples of this class by reference, see `boom_twin.kernels.references`."""
    _BY_REFERENCE.add(kind)
    _UNREGISTERED.append(kind)
    return kind


@cache
def _numba() -> Any:
    """numba, with its settings from the environment only."""
    if Path(CONFIG_FILE).exists():
        file = Path(CONFIG_FILE).absolute()
        raise UsageError(f"{file}: would change how the model is compiled. Move it away, or start elsewhere.")
    # numba words an error for every signature that it tries; where colorama is installed, colours take a twentieth of compiling
    os.environ.setdefault(NO_COLOURS, "1")
    import numba

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


def _register_references() -> None:
    """Make the classes known that are to be taken by reference; no thread takes one for known that is not yet."""
    if _UNREGISTERED:
        from .references import register

        with _REGISTERING:
            while _UNREGISTERED:
                register(_UNREGISTERED[0])
                del _UNREGISTERED[0]


def _kind(value: Any) -> Any:
    """Return all that numba's type of an argument depends on, fifty times as fast as that type."""
    if isinstance(value, np.ndarray):
        return type(value), value.dtype, value.ndim, value.flags.num & LAYOUT
    if isinstance(value, HeldFields):
        return _kind(value.fields)
    return (type(value), *map(_kind, value)) if isinstance(value, tuple) else type(value)


class HeldFields(int):
    """Address of the fields of a named tuple that kernels take by reference, see `hold`; with all that stands there."""

    fields: Any
    kept: Any
    type: Any = None  # numba's, once it is known

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy is of fields of its own: the address is of these."""
        return hold, (self.fields,)


class Kernel:
    """A function that is compiled when Python first calls it, or when a kernel that calls it is compiled."""

    _cached = True

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self._options = function, options
        self._compiled: dict[Any, Callable[..., Any]] = {}

    @cached_property
    def dispatcher(self) -> Any:
        """numba's object, made on first use."""
        numba = _numba()
        _register_references()
        dispatcher = numba.njit(**OPTIONS, **self._options, **self._compiler())(self.py_func)
        if self._cached and not numba.config.DISABLE_JIT and (folder := _folder()) is not None:
            try:
                dispatcher._cache = KernelCache(self.py_func, folder)
            except (ImportError, AttributeError) as error:
                _tell_not_kept(f"numba {numba.__version__} is not the one that was tested ({error})")
        return dispatcher

    @property
    def is_compiled(self) -> bool:
        """Return True if calls run compiled code, not plain Python."""
        return hasattr(self.dispatcher, "overloads")

    def _compiler(self) -> dict[str, Any]:
        """Return the options that name the compiler instead of numba's own."""
        from .inlining import KernelCompiler

        return {"pipeline_class": KernelCompiler}

    @cached_property
    def _numba_type_(self) -> Any:
        from .inlining import CalledKernel

        return CalledKernel(self.dispatcher)

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*map(_argument, arguments))

    def for_types_of(self, *examples: Any) -> Callable[..., Any]:
        """The compiled code for arguments of the types of `examples`, for a caller whose arguments always are of these.

        It does not look at types again, which takes 10 to 20 us of every call with a boom's tables. Arrays of another layout or
        kind of numbers would be read wrongly: the caller makes sure that there are none.
        """
        dispatcher = self.dispatcher
        if not self.is_compiled:
            return self
        if (kinds := _kind(examples)) not in self._compiled:
            types = tuple(dispatcher.typeof_pyval(each) for each in examples)
            dispatcher.compile(types)
            self._compiled[kinds] = dispatcher.overloads[types].entry_point
        return self._compiled[kinds]


class SameTypes:
    """A kernel for a caller whose arguments always are of the types that it first calls with, see `Kernel.for_types_of`."""

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._call: Callable[..., Any] | None = None

    def __call__(self, *arguments: Any) -> Any:
        if self._call is None:
            self._call = self._kernel.for_types_of(*arguments)
        return self._call(*arguments)


class Inner(Kernel):
    """A kernel that exists compiled only inside others; called from Python it runs as Python."""

    _cached = False

    def _compiler(self) -> dict[str, Any]:
        from .inlining import InlinedCompiler

        return {"pipeline_class": InlinedCompiler}

    def __call__(self, *arguments: Any) -> Any:
        return self.py_func(*arguments)


def _packed(value: Any) -> tuple[str, Sequence[Any]]:
    """Return how compiled code has a value in memory, eight bytes a number: a format of `struct`, and the numbers."""
    if isinstance(value, np.ndarray):  # see `ARRAY`
        return f"{5 + 2 * value.ndim}q", (0, 0, value.size, value.itemsize, value.ctypes.data, *value.shape, *value.strides)
    if isinstance(value, tuple):
        layouts, numbers = zip(*map(_packed, value), strict=True)
        return "".join(layouts), [number for each in numbers for number in each]
    return "d" if isinstance(value, float) else "q", [value]


def kernel(function: Callable[..., Any]) -> Kernel:
    """Compile `function`: nopython, cached on disk, without the interpreter's lock, no exceptions for division."""
    return Kernel(function)


def inner(function: Callable[..., Any]) -> Inner:
    """Compile as `kernel` does, inlined wherever a kernel calls it; Python runs it as it stands."""
    return Inner(function, forceinline=True, no_cpython_wrapper=True)


def _argument(value: Any) -> Any:
    """Return what `hold` does; for one of the newest `MOST_HELD` tuples, what it did before."""
    if type(value) not in _BY_REFERENCE:
        return value
    if (held := _NEWEST.get(id(value))) is None:
        held = hold(value)
        with _REGISTERING:
            while len(_NEWEST) >= MOST_HELD:
                del _NEWEST[next(iter(_NEWEST))]
            _NEWEST[id(value)] = held  # it holds the tuple, so that no other one has its identity
    return held


def hold(value: Any) -> Any:
    """Return a stand-in for a named tuple that compiled code takes by reference; anything else as it is.

    Its fields are written once, here, and not with every call. It stands for this very tuple: what its arrays hold may change.
    """
    if type(value) not in _BY_REFERENCE or _numba().config.DISABLE_JIT:
        return value
    _register_references()  # the class may have come after the first kernel was made
    kept = value._make(map(hold, value))
    layout, numbers = _packed(kept)
    room = np.frombuffer(struct.pack(layout, *numbers), np.uint8)
    held = HeldFields(room.ctypes.data)
    held.fields, held.kept = value, (kept, room)
    return held
