"""Which .mcap files a session consists of."""

from __future__ import annotations

import re
from pathlib import Path

from ..errors import BagError
from ..received import holds_file
from .bagmeta import FILE_NAME, BagMetadata, read_metadata


def mcap_files(path: Path) -> list[Path]:
    """The files of a session without metadata; BagError if there are none."""
    if path.is_file():
        return [path.resolve() if path.is_symlink() else path]  # the user's own word, unlike a link in a folder
    if not path.is_dir():
        raise BagError(f"{path}: there is no such file or directory. Give a rosbag2 directory or an .mcap file.")
    files = sorted(path.glob("*.mcap"))
    if not files:
        there = ", ".join(sorted(entry.name for entry in path.iterdir())[:8]) or "nothing"
        raise BagError(f"{path}: no .mcap file and no {FILE_NAME} in it (there is: {there}). Give a rosbag2 directory.")
    return files


def check_listed(path: Path, named: list[Path]) -> None:
    """Refuse to pass over a file that a recorder left behind when it was killed."""
    if unlisted := sorted(file.name for file in path.glob("*.mcap") if file not in named):
        raise BagError(
            f"{path}: {FILE_NAME} does not name {', '.join(unlisted)}: the recorder was ended by force. "
            "`boom_twin recover BAG --out DIR` saves all of it; or move the file away."
        )


def sources(path: Path) -> tuple[list[Path], BagMetadata | None]:
    """The .mcap files of a session: those that its metadata names, then all others by number; and the metadata."""
    metadata: BagMetadata | None = None
    is_described = holds_file(path / FILE_NAME)
    try:
        metadata = read_metadata(path / FILE_NAME) if is_described else None
    except BagError:
        if path.is_file():
            raise
    named = [path / Path(name).name for name in metadata.relative_file_paths] if metadata else []
    there = [file for file in named if holds_file(file)]
    others = [] if there and not any(path.glob("*.mcap")) else mcap_files(path)
    return there + sorted(set(others) - set(there), key=_by_number), metadata


def _by_number(path: Path) -> list[tuple[int, str]]:
    """Sorts ``session_10`` behind ``session_9``."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]
