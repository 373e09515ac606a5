"""Open files of a folder that was received from a stranger: only regular files that lie in it.

A link in such a folder can lead to any file of the reader. A pipe makes a program wait for ever. A device can be a disk.
A path given on the command line may be a link; a file in a received folder may not.
"""

from __future__ import annotations

import os
import stat
from contextlib import ExitStack
from errno import ENOENT
from hashlib import file_digest
from io import BufferedReader
from pathlib import Path

from ..errors import BagError

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
