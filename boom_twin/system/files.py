"""Files: write them whole or not at all, and open those of a folder that was received from a stranger.

Of a received folder, only regular files that lie in it are opened. A link in such a folder can lead to any file of the reader.
A pipe makes a program wait for ever. A device can be a disk. A path given on the command line may be a link.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from errno import ENOENT
from hashlib import file_digest
from io import BufferedReader
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


def check_new(path: Path, sources: Sequence[Path], force: bool | None = None) -> None:
    """Refuse to write what exists and is not empty, unless by ``--force`` (None: the command has no such option).

    Otherwise check it as `check_target` does.
    """
    check_target(path, sources)
    if not force and path.exists() and path.stat().st_size:
        remedy = "" if force is None else ", or give --force to replace it"
        raise UsageError(f"{path}: is there already. Name another file{remedy}.")


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


_KINDS = {"l": "a symbolic link", "d": "a directory", "p": "a named pipe", "s": "a socket", "b": "a device", "c": "a device"}
"""Kinds of entries that are no regular files, by the first letter of `stat.filemode`."""


def real_path(path: Path) -> Path:
    """Return an absolute path with its links followed; BagError if they lead in a circle."""
    try:
        return path.resolve()
    except RuntimeError:
        raise BagError(f"{path}: a symbolic link that leads to itself. Give the folder or file itself.") from None


def holds_file(path: Path) -> bool:
    """Return True if `open_received` can open a file at `path`; False if nothing is there; BagError for no regular file."""
    try:
        mode = path.lstat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return False
    except (OSError, ValueError) as error:
        raise BagError(f"{path}: cannot be read ({error}). Check its name and its permissions.") from None
    _check_regular(path, mode)
    return True


def open_received(path: Path) -> BufferedReader:
    """Open a file of a received folder for reading; BagError for a link, directory, pipe, socket or device."""
    if not holds_file(path):
        raise FileNotFoundError(ENOENT, os.strerror(ENOENT), str(path))
    with ExitStack() as stack:
        file = stack.enter_context(open(path, "rb", opener=_without_links))
        _check_regular(path, os.fstat(file.fileno()).st_mode)
        stack.pop_all()
        return file


def _without_links(path: str, flags: int) -> int:
    """Open a checked path. If it was exchanged since the check, neither follow a link nor wait for a pipe."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY)


def _check_regular(path: Path, mode: int) -> None:
    if not stat.S_ISREG(mode):
        kind = _KINDS.get(stat.filemode(mode)[0], "no regular file")
        remedy = "Copy the folder with its links followed, `cp -rL FOLDER COPY`, and read the copy."
        raise BagError(f"{path}: {kind}, not opened in a session's folder. {remedy if stat.S_ISLNK(mode) else 'Move it away.'}")


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file, read in blocks. Errors are those of `open_received`."""
    with open_received(path) as file:
        return file_digest(file, "sha256").hexdigest()
