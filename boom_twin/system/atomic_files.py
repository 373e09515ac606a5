"""Write files that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from secrets import token_hex

from ..errors import BagError, UsageError

DRAFT = ".draft"  # suffix of a file that is being written; its name begins with a dot; a killed process may leave one

HEAD = 4096  # number of first bytes of a file that identify an earlier result

_RECORDINGS = frozenset({".mcap", ".db3", ".bag"})
_BESIDE_THEM = frozenset({"metadata.yaml", "session.yaml", "truth.csv.gz"})


def write_atomic(path: Path, content: str | bytes) -> None:
    """Write a file as a temporary one beside it, which is synced to the disk and then renamed; BagError if it cannot be.

    `path` has the old content or the new one at any time, also after a kill or the loss of power. A path that is no regular
    file (``/dev/stdout``, a pipe) is written to directly. The target of a symbolic link is replaced. Text is encoded as UTF-8,
    its surrogates (bytes of a path) as escapes.
    """
    data = content.encode(errors="backslashreplace") if isinstance(content, str) else content
    try:
        if path.exists() and not path.is_file():
            with path.open("wb") as stream:
                stream.write(data)
            return
        _replace(path.resolve(), data)
    except OSError as error:
        remedy = "Make room on the disk, or choose another place."
        if isinstance(error, FileNotFoundError):
            remedy = f"Make its folder first: mkdir -p {path.parent}"
        reason = f"cannot be written ({error.strerror}). {remedy}"
        raise BagError(f"{path}: {reason}") from error


def check_target(path: Path, sources: Sequence[Path], own: bytes | Callable[[bytes], bool] | None = None) -> None:
    """Raise UsageError if a write would replace a source, a file of a recording, or another program's.

    To be called before the work. The target of a symbolic link is checked, because `write_atomic` replaces it. `own` are the
    first bytes of an earlier result of the same command, or a function that returns True for the first `HEAD` bytes of one;
    None: any file may be replaced.
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
    """Refuse to write a file that exists and is not empty. Otherwise check it as `check_target` does."""
    check_target(path, sources)
    if path.is_file() and path.stat().st_size:
        raise UsageError(f"{path}: is there already, and is not written over. Name another file.")


def _is_recording(path: Path) -> bool:
    """Return True if the name is that of a recording, also of one that rosbag2 compressed as a whole (``.mcap.zstd``)."""
    return not _RECORDINGS.isdisjoint(path.suffixes[-2:])


def sync_folder(folder: Path) -> None:
    """Sync the entries of a folder to the disk, if its file system supports that."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)


def _replace(path: Path, data: bytes) -> None:
    draft = path.with_name(f".{path.name}.{token_hex(4)}{DRAFT}")
    try:
        with draft.open("xb") as stream:
            stream.write(data)
            stream.flush()
            if path.exists():
                with suppress(PermissionError):  # of a file system without permissions
                    os.fchmod(stream.fileno(), stat.S_IMODE(path.stat().st_mode))
            os.fsync(stream.fileno())
        draft.replace(path)
    except BaseException:
        with suppress(OSError):
            draft.unlink()
        raise
    sync_folder(path.parent)
