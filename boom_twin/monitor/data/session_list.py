"""Recorded sessions of a folder, of which the live page shows one at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ...bag.storages import is_session
from ...errors import BagError, BoomTwinError
from .feed import Feed


def sessions_in(path: Path) -> list[Path]:
    """Return the sessions in a folder, by name; the path itself if it is a session, or holds none."""
    if not path.is_dir() or is_session(path):
        return [path]
    return sorted(each for each in path.iterdir() if is_session(each)) or [path]


class SessionList:
    """Recorded sessions, of which one is open at a time: its `index` among the `names`, and its `feed`.

    The first of `paths` that can be read is opened at once; `open_feed` returns the feed of a path.

    Raises
    ------
    BoomTwinError
        No session can be read. From `open`: this one cannot.
    """

    def __init__(self, paths: Sequence[Path], open_feed: Callable[[Path], Feed]) -> None:
        self._paths, self._open_feed = paths, open_feed
        self.names = [path.name for path in paths]
        errors: list[BoomTwinError] = []
        for self.index in range(len(paths)):
            try:
                self.feed = self.open(self.index)
                self.feed.trouble = "; ".join(map(str, errors))
                return
            except BoomTwinError as error:
                errors.append(error)
        raise errors[0]

    def open(self, index: int) -> Feed:
        """Return the feed of a session, which is shown from `show` on. Nothing else changes, so a thread may wait for it."""
        try:
            return self._open_feed(self._paths[index])
        except OSError as error:
            raise BagError(f"{self._paths[index]}: cannot be read ({error.strerror}). Choose another session.") from None

    def show(self, index: int, feed: Feed) -> None:
        """Replace the feed by that of another session, and close the one before."""
        before, self.feed, self.index = self.feed, feed, index
        before.close()

    def close(self) -> None:
        """Close the feed that is open."""
        self.feed.close()
