"""Write files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import mkstemp

from ..errors import BagError, UsageError

DRAFT = ".draft"
"""How the name of a file ends that is being written; it begins with a dot. A kill may leave one."""

HEAD = 4096
"""Bytes of a file by which an earlier result is known."""

_RECORDINGS = frozenset({".mcap", ".db3", ".bag"})
_BESIDE_THEM = frozenset({"metadata.yaml", "session.yaml", "truth.csv.gz"})

_umask = os.umask(0)
os.umask(_umask)


def write_atomic(path: Path, content: str | bytes, sync: Callable[[int], None] = os.fsync) -> None:
    """Write a file by way of a temporary one beside it, which is put on the disk and then renamed.

    Whoever opens `path`, also after a kill or the loss of power, finds the old content or the new one. What is no
    regular file (``/dev/stdout``, a pipe) is written to as it is; of a symbolic link, its target is replaced.

    Parameters
    ----------
    path : Path
    content : str or bytes
        Text is encoded as UTF-8, what is no character in it (a path's bytes) as an escape.
    sync : callable, optional
        Puts on the disk what has the descriptor that it is given.

    Raises
    ------
    BagError
        It cannot be written; `path` is then as it was.
    """
    data = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    try:
        if path.exists() and not path.is_file():
            with path.open("wb") as stream:
                stream.write(data)
            return
        _replace(path.resolve(), data, sync)
    except OSError as error:
        remedy = "Make room on the disk, or choose another place."
        if isinstance(error, FileNotFoundError):
            remedy = f"Make its folder first: mkdir -p {path.parent}"
        reason = f"cannot be written ({error.strerror}). {remedy}"
        raise BagError(f"{path}: {reason}") from error


def check_target(path: Path, sources: Sequence[Path], own: bytes | Callable[[bytes], bool] | None = None) -> None:
    """Refuse to replace a file that is read, one of a recording, or one that another wrote; to be asked before the work begins.

    Parameters
    ----------
    path : Path
        If it is a symbolic link, its target is judged: that is what `write_atomic` replaces.
    sources : sequence of Path
        What is read.
    own : bytes or callable, optional
        How an earlier result of the same command begins, which is replaced, or whether what begins so (the first `HEAD` bytes)
        is one. None: any file is replaced.

    Raises
    ------
    UsageError
        Names the file.
    """
    for source in sources:
        if path.resolve() == source.resolve() or (path.exists() and source.exists() and path.samefile(source)):
            raise UsageError(f"{path}: this file is read. Name another one to be written.")
    if not path.is_file():
        return
    real = path.resolve()
    is_beside = any(_is_recording(entry) for entry in real.parent.iterdir())
    if _is_recording(real) or (is_beside and real.name in _BESIDE_THEM):
        raise UsageError(f"{path}: this is a file of a recording, and none is written over. Name another file.")
    if own is not None:
        with real.open("rb") as stream:
            start = stream.read(HEAD)
        if start and not (start.startswith(own) if isinstance(own, bytes) else own(start)):
            raise UsageError(f"{path}: is there already, and is no earlier result of this command. Name another file.")


def check_new(path: Path, sources: Sequence[Path]) -> None:
    """As `check_target`, of a file that is never replaced: none may be there but an empty one."""
    check_target(path, sources)
    if path.is_file() and path.stat().st_size:
        raise UsageError(f"{path}: is there already, and is not written over. Name another file.")


def _is_recording(path: Path) -> bool:
    """Whether the name is one of a recording, also of one that rosbag2 packed as a whole (``.mcap.zstd``)."""
    return not _RECORDINGS.isdisjoint(path.suffixes[-2:])


def sync_folder(folder: Path, sync: Callable[[int], None] = os.fsync) -> None:
    """Put the names in a folder on the disk, where its file system can do that."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        sync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)


def _replace(path: Path, data: bytes, sync: Callable[[int], None]) -> None:
    handle, name = mkstemp(prefix=f".{path.name}.", suffix=DRAFT, dir=path.parent)
    draft = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            with suppress(PermissionError):  # of a file system without permissions
                os.fchmod(stream.fileno(), _mode(path))
            sync(stream.fileno())
        draft.replace(path)
    except BaseException:
        with suppress(OSError):
            draft.unlink()
        raise
    sync_folder(path.parent, sync)


def _mode(path: Path) -> int:
    """The permissions of the file that is replaced, or those of a new one."""
    return stat.S_IMODE(path.stat().st_mode) if path.exists() else 0o666 & ~_umask
