"""Recorded sessions of a folder, of which the live page shows one at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ...bag.storages import is_session
from .feed import Feed


def sessions_in(path: Path) -> list[Path]:
    """The sessions that lie in a folder, by name; the path itself where it is one, or holds none."""
    if not path.is_dir() or is_session(path):
        return [path]
    return sorted(each for each in path.iterdir() if is_session(each)) or [path]


class SessionList:
    """Opens one session after the other.

    Parameters
    ----------
    paths : sequence of Path
        At least one; the first is opened at once.
    open_feed : callable
        Gives the feed of a path.

    Attributes
    ----------
    names : list of str
        What viewers choose from.
    index : int
        Of the one that is open.
    feed : Feed
        Of that.

    Raises
    ------
    BoomTwinError
        From here and `open`: the session cannot be read; the one before stays.
    """

    def __init__(self, paths: Sequence[Path], open_feed: Callable[[Path], Feed]) -> None:
        self._paths, self._open_feed = paths, open_feed
        self.names, self.index = [path.name for path in paths], 0
        self.feed = open_feed(paths[0])

    def open(self, index: int) -> Feed:
        """Open another session and close the one before; gives its feed."""
        feed = self._open_feed(self._paths[index])
        before, self.feed, self.index = self.feed, feed, index
        before.close()
        return feed

    def close(self) -> None:
        """Close the one that is open."""
        self.feed.close()
