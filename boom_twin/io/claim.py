"""A directory that a bag may be written to."""

from __future__ import annotations

from pathlib import Path

from ..errors import BagError
from .results import UNFINISHED


def claim(directory: Path) -> None:
    """Make the directory; refuse one that holds anything but the mark of a result that is being built.

    Raises
    ------
    BagError
        It is not empty, or cannot be made.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        taken = sorted(entry.name for entry in directory.iterdir() if entry.name != UNFINISHED)
    except OSError as error:
        raise BagError(f"{directory}: cannot be made ({error.strerror}). Choose another place.") from error
    if taken:
        raise BagError(f"{directory}: holds {taken[0]} already, and nothing is overwritten. Choose a new directory.")
