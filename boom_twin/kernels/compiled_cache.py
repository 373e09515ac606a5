"""Cache of compiled kernels on disk: its folder, its owner and mode, and the checksum of every file in it.

Loading one runs machine code. So nobody but the user (and root) may be able to write it, and a file that is cut off or
altered must not be taken: every file begins with the SHA-256 of the rest, and is written whole or not at all. numba's own
cache has neither check. It does not see either that a kernel in another file has changed: the folder is named after a hash of
all kernel sources, so an edit anywhere gives a new folder.
"""

from __future__ import annotations

import grp
import hashlib
import os
import pickle
import pwd
import re
import shutil
import stat
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from importlib import import_module
from io import BytesIO
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
KERNEL_SOURCES = (
    "kernels", "analysis/equilibrium.py", "deviation", "twin/update.py",
    "twin/state.py",
    "calibration/rest_filter.py",
    "health/sensor_survey.py", "health/sensor_findings.py", "types.py", "sensor_kinds.py",
)  # fmt: skip
"""Folders and modules of the package that kernels, or the constants in them, come from."""
NO_COLOURS = "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING"
SUFFIX, USER = ".kernel", ".user"
CACHE_NAME = re.compile("[0-9a-f]{16}")
KEPT = 30 * 86400.0  # s for which a cache is kept that no known installation uses
_DIGEST = hashlib.sha256().digest_size


def source_hash(root: Path = ROOT) -> str:
    """Hash of every kernel source, and of numba's settings in the environment, 16 hex digits."""
    digest = hashlib.sha256()
    for name in KERNEL_SOURCES:
        for path in sorted((root / name).rglob("*.py")) or [root / name]:
            digest.update(path.relative_to(root).as_posix().encode() + b"\0")
            digest.update(path.read_bytes())
    digest.update(repr(_settings()).encode())
    return digest.hexdigest()[:16]


def _settings() -> list[tuple[str, str]]:
    """Return numba's settings in the environment, on which compiled code depends."""
    without = "NUMBA_CACHE_DIR", NO_COLOURS
    return sorted(pair for pair in os.environ.items() if pair[0].startswith("NUMBA_") and pair[0] not in without)


def cache_root() -> Path:
    """Return the folder of all caches: ``NUMBA_CACHE_DIR``, else ``boom_twin`` in the user's cache.

    A relative path in ``XDG_CACHE_HOME`` counts as none, as its specification says.
    """
    if own := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(own)
    home = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (home if home.is_absolute() else Path(os.path.expanduser("~/.cache"))) / "boom_twin"


def cache_folder() -> Path:
    """Return the folder of kernels of this source state."""
    return cache_root() / source_hash()


def all_caches() -> list[Path]:
    """Return the folders of kernels of all source states."""
    return [each for each in cache_root().glob("*") if CACHE_NAME.fullmatch(each.name) and not each.is_symlink()]


def claim(folder: Path) -> None:
    """Note in `folder` that this installation uses it, and remove caches that no installation uses.

    The cache of an earlier state of this installation is removed, unless another one uses it too. A cache whose installations
    are gone or unknown is removed if nothing was written there for `KEPT` s.
    """
    settings = _settings()
    name = hashlib.sha256(repr((str(ROOT), settings)).encode()).hexdigest()[:16] + USER
    with suppress(OSError):
        if (folder / name).exists():
            return
        write_checked(folder / name, str(ROOT).encode())
        for other in set(all_caches()) - {folder}:
            is_own = (other / name).exists()
            (other / name).unlink(missing_ok=True)
            is_used = any(Path((read_checked(user) or b"").decode() or "?").exists() for user in other.glob(f"*{USER}"))
            if not is_used and (is_own or time.time() - other.stat().st_mtime > KEPT):
                shutil.rmtree(other, ignore_errors=True)


def fault_of(folder: Path) -> str | None:
    """Return why machine code from `folder` is not to be trusted or cannot be kept; None if all is well.

    The folder is made if needed.
    """
    if not folder.is_absolute():
        return f"{folder} is a relative path: give NUMBA_CACHE_DIR an absolute one"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        real = folder.resolve(strict=True)
        for place in (real, *real.parents):
            if fault := _writers(place.stat(), may_be_sticky=place != real):
                return f"{place} {fault}"
        with NamedTemporaryFile(dir=real):
            pass
    except OSError as error:
        return f"{error.filename or folder}: {error.strerror}"
    return None


def _writers(state: os.stat_result, may_be_sticky: bool = False) -> str | None:
    """Return who but the user and root can write something, in words with the remedy; None if nobody."""
    if state.st_uid not in (os.getuid(), 0):
        return f"belongs to user {state.st_uid}: set NUMBA_CACHE_DIR to a folder of your own"
    if may_be_sticky and state.st_mode & stat.S_ISVTX:  # as /tmp: others may add entries, but not exchange them
        return None
    if state.st_mode & stat.S_IWOTH or (state.st_mode & stat.S_IWGRP and not _is_own_group(state.st_gid)):
        return "can be written by others: `chmod go-w` it"
    return None


def _is_own_group(number: int) -> bool:
    """Return True if a group holds nobody but the user, or root, by its name and its members."""
    if number == 0:
        return True
    try:
        group, name = grp.getgrgid(number), pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return False
    return group.gr_name == name and set(group.gr_mem) <= {name}


class KernelCache:
    """The compiled code of one kernel on disk; has what numba's dispatcher asks of a cache.

    A load does not fill numba's tables of types and of BLAS, which takes 0.25 s. Compiling needs them, and fills them itself.
    The intermediate code is not kept: it would be four fifths of a load, and a call needs the machine code only. Kernels that
    this one calls are loaded before it.

    ImportError or AttributeError if numba does not have its parts where the tested versions have them.
    """

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        from numba import __version__
        from numba.core.compiler import CompileResult

        self._rebuild, self._reduce = CompileResult._rebuild, CompileResult._reduce
        self._name, self._folder = f"{function.__module__}.{function.__qualname__}", folder
        self._version = (__version__, sys.implementation.cache_tag, function.__code__.co_code)

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self._folder)

    def load_overload(self, signature: Any, context: Any) -> Any:
        """The compiled kernel for a signature; None if it is not there, or not as it was written."""
        data = read_checked(self._path(signature, context.codegen()))
        if data is None:
            return None
        symbols, callee, calls, parts = pickle.loads(data)
        if not all(_is_there(each, context.codegen()._engine) for each in calls):
            return None
        (name, kind, machine), *others = _Parts(BytesIO(parts)).load()
        context.codegen()._engine._defined_symbols.update(symbols)
        loaded = self._rebuild(context, (name, kind, (machine, _nothing(context.codegen()))), *others)
        loaded.library.callee = callee
        return loaded

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Keep a compiled kernel; a full disk or a folder that went away is no reason to stop.

        Neither is machine code that is not at hand: LLVM hands it over in a callback, where the exception of a signal is lost.
        """
        library = compiled.library
        if compiled.lifted or library.has_dynamic_globals or library._compiled_object is None:
            return
        with suppress(OSError):
            (name, kind, (machine, _)), *others = self._reduce(compiled)
            parts = pickle.dumps(((name, kind, machine), *others))
            kept = pickle.dumps((_symbols(library), library.callee, library.calls, parts))
            write_checked(self._path(signature, compiled.codegen), kept)

    def enable(self) -> None:
        """Do nothing, for the cache is always enabled."""

    def flush(self) -> None:
        """Do nothing, for nothing is kept in memory."""

    def _path(self, signature: Any, codegen: Any) -> Path:
        key = repr((self._version, str(signature), codegen.magic_tuple()))
        return self._folder / f"{self._name}-{hashlib.sha256(key.encode()).hexdigest()[:16]}{SUFFIX}"


class _Parts(pickle.Unpickler):
    """Unpickler of a compiled kernel without the modules of numba's own functions in it, whose import takes 0.03 s.

    Of a function's `Environment`, machine code needs constants only; the name of its module is kept for a copy on disk.
    """

    def find_class(self, module: str, name: str) -> Any:
        found = super().find_class(module, name)
        return partial(_environment, found.__globals__) if name == "_rebuild_env" else found


def _environment(numba: dict[str, Any], module: str, constants: list[Any], name: str) -> Any:
    """Do as numba's `_rebuild_env`, with the globals `numba` of which this is called, but do not import `module`."""
    if (found := numba["lookup_environment"](name)) is None:
        found = numba["Environment"]({"__name__": module})
        found.consts[:], found.env_name = constants, name
        numba["Environment"]._memo[name] = found
    return found


def _symbols(library: Any) -> list[str]:
    """Names of what a library defines, which numba else looks for in its intermediate code."""
    module = library._get_module_for_linking()
    return [each.name for group in (module.functions, module.global_variables) for each in group if not each.is_declaration]


def _is_there(callee: Any, engine: Any) -> bool:
    """Load or compile a kernel that is called, if need be; return True if its machine code is there."""
    kernel = getattr(sys.modules.get(callee.module) or import_module(callee.module), callee.name, None)
    if kernel is not None:
        kernel.dispatcher.compile(callee.arguments)
    return bool(engine.is_symbol_defined(callee.symbol))


@cache
def _nothing(codegen: Any) -> bytes:
    """Return intermediate code without any function, in place of a loaded kernel's."""
    return bytes(codegen.create_library("nothing")._final_module.as_bitcode())


def read_checked(path: Path) -> bytes | None:
    """Return what `write_checked` wrote; None if nothing is there, it is not as it was written, or others can write it."""
    try:
        with open(path, "rb", opener=_without_links) as file:
            state = os.fstat(file.fileno())
            if not stat.S_ISREG(state.st_mode) or _writers(state):
                return None
            told, data = file.read(_DIGEST), file.read()
    except OSError:
        return None
    return data if hashlib.sha256(data).digest() == told else None


def _without_links(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK)


def write_checked(path: Path, data: bytes) -> None:
    """Write a file with the checksum of its content before it, whole or not at all."""
    with NamedTemporaryFile(dir=path.parent, prefix=".", suffix=".draft", delete=False) as file:
        draft = Path(file.name)
        try:
            file.write(hashlib.sha256(data).digest() + data)
            file.flush()
            draft.replace(path)
        except BaseException:
            draft.unlink(missing_ok=True)
            raise
