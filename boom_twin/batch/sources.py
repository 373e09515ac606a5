"""Which sessions a batch is of: paths, globs, and files that list them."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator
from hashlib import sha256
from pathlib import Path

from ..bag.session_sheet import sheet_path
from ..bag.storages import is_session
from ..errors import UsageError
from ..system.received_files import real_path

LIST = ".txt"
"""How the name of a file ends that lists sessions."""


def sessions_of(sources: Iterable[str]) -> list[Path]:
    """All sessions that are named, each once, in the order of their names there.

    Parameters
    ----------
    sources : iterable of str
        Paths of sessions, globs, or files ``*.txt`` with one of these a line, where ``#`` begins a comment; relative paths in
        a file are those from its folder. A path without wildcards is taken as it is, whether it is there or not.

    Raises
    ------
    UsageError
        A glob fits no session, or a list cannot be read or is empty.
    """
    found: dict[Path, Path] = {}
    for source in sources:
        for path in _listed(Path(source)) if source.endswith(LIST) else _matching(source):
            found.setdefault(real_path(path), path)
    return list(found.values())


def _listed(file: Path) -> Iterator[Path]:
    try:
        lines = [line.split("#")[0].strip() for line in file.read_text(encoding="utf-8").splitlines()]
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{file}: cannot be read as a list of sessions ({error}). Write a path or glob a line.") from None
    if not any(lines):
        raise UsageError(f"{file}: lists no session. Write a path or glob a line.")
    for line in filter(None, lines):
        yield from _matching(str(file.parent / line))


def _matching(pattern: str) -> Iterator[Path]:
    """The path, or the sessions that a glob fits: folders that hold one, and single files."""
    if not glob.has_magic(pattern) or Path(pattern).exists():
        yield Path(pattern)
        return
    found = [path for path in map(Path, sorted(glob.glob(pattern, recursive=True))) if is_session(path)]
    if not found:
        raise UsageError(f"{pattern}: fits no session, a folder of a rosbag2 or a file of a session. Check it, and quote it.")
    yield from found


def key_of(session: Path) -> str:
    """Name of a session's files among the results: its own, and a digest of its path."""
    path = real_path(session)
    name = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in path.stem)
    return f"{name[:40]}-{sha256(str(path).encode(errors='surrogateescape')).hexdigest()[:10]}"


def fingerprint(session: Path, options: str) -> str:
    """Changes with the files of a session, by their sizes and times of change, and with the options of the batch."""
    files = sorted(session.iterdir()) if session.is_dir() else [session, sheet_path(session)]
    told = [options]
    for file in files:
        if file.is_file():
            about = file.stat()
            told.append(f"{file.name} {about.st_size} {about.st_mtime_ns}")
    return sha256("\n".join(told).encode(errors="surrogateescape")).hexdigest()[:16]
