"""A directory that a bag may be written to."""

from __future__ import annotations

from pathlib import Path

from ..errors import BagError


def claim(directory: Path) -> None:
    """Make the directory; refuse one that holds anything.

    Raises
    ------
    BagError
        It is not empty, or cannot be made.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        taken = sorted(entry.name for entry in directory.iterdir())
    except OSError as error:
        raise BagError(f"{directory}: cannot be made ({error.strerror}). Choose another place.") from error
    if taken:
        raise BagError(f"{directory}: holds {taken[0]} already, and nothing is overwritten. Choose a new directory.")
