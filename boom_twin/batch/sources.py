"""Sessions of a batch from paths, globs, and files that list them."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterable, Iterator
from hashlib import sha256
from pathlib import Path

from ..bag.reader import is_session
from ..bag.session_model import sheet_path
from ..errors import UsageError

LIST = ".txt"  # suffix of a file that lists sessions


def sessions_of(sources: Iterable[str]) -> list[Path]:
    """Return all sessions of the sources, each once, in the order of the sources.

    Sources are paths of sessions, globs, or files ``*.txt`` with one of these a line, where ``#`` begins a comment. Relative
    paths in a file start at its folder. A path without wildcards is taken as it is, whether it is there or not. UsageError if
    a glob fits no session, or a list cannot be read or is empty.
    """
    found: dict[str, Path] = {}
    for source in sources:
        for path in _listed(Path(source)) if source.endswith(LIST) else _matching(source):
            found.setdefault(os.path.realpath(path), path)
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
    """Yield a path, or the sessions (folders and single files) that a glob fits."""
    if not glob.has_magic(pattern) or Path(pattern).exists():
        yield Path(pattern)
        return
    found = [path for path in map(Path, sorted(_expanded(pattern))) if is_session(path)]
    if not found:
        raise UsageError(f"{pattern}: fits no session, a folder of a rosbag2 or a file of a session. Check it, and quote it.")
    yield from found


def _expanded(pattern: str) -> Iterator[str]:
    """Yield the paths that a glob fits. ``**`` does not follow links, which may lead in a circle."""
    before, *after = re.split(r"(?<![^/])\*\*(?![^/])", pattern, maxsplit=1)
    if not after:
        yield from glob.glob(pattern)
        return
    for top in glob.glob(before or "."):
        if not after[0]:
            yield top
        for folder, inner, _ in os.walk(top):
            inner[:] = [name for name in inner if not name.startswith(".")]
            yield from _expanded(glob.escape(folder) + (after[0] or "/*"))


def key_of(session: Path) -> str:
    """Return the key of a session among the results: its name and a digest of its path."""
    path = Path(os.path.realpath(session))
    name = "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in path.stem)
    return f"{name[:40]}-{sha256(str(path).encode(errors='surrogateescape')).hexdigest()[:10]}"


def fingerprint(session: Path, options: str) -> str:
    """Return a digest of the names, sizes and times of change of a session's files and of the options of the batch."""
    files = sorted(session.iterdir()) if session.is_dir() else [session, sheet_path(session)]
    told = [options]
    for file in files:
        if file.is_file():
            about = file.stat()
            told.append(f"{file.name} {about.st_size} {about.st_mtime_ns}")
    return sha256("\n".join(told).encode(errors="surrogateescape")).hexdigest()[:16]
