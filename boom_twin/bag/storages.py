"""Kinds of files in which a session may be stored, by their suffixes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from . import csv_file, mcap_file, ros1_file, sqlite_file
from .metadata import STORAGES, refuse_packed
from .session_file import SessionFile

SUMMARISE: dict[str, Callable[[Path], SessionFile]] = {
    ".mcap": mcap_file.summarise,
    ".db3": sqlite_file.summarise,
    ".bag": ros1_file.summarise,
    ".csv": csv_file.summarise,
}
"""Function for each suffix. Files of rosbag2 may lie in a folder, see `STORAGES`; any other file is a session by itself."""


def summarise(path: Path) -> SessionFile:
    """Return the content of one file. A file with an unknown suffix is read as .mcap.

    Raise BagError if the file is missing, of another kind, cut off or damaged.
    """
    refuse_packed(path)
    return SUMMARISE.get(path.suffix.lower(), SUMMARISE[".mcap"])(path)


def is_session(path: Path) -> bool:
    """Return True if the names of the files at `path` are those of a session."""
    if path.is_dir():
        return any(file.suffix in STORAGES for file in path.iterdir())
    return path.suffix.lower() in SUMMARISE
