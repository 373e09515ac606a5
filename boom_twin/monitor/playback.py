"""Where one viewer is in a recorded session."""

from __future__ import annotations

from .feed import Feed

SLOWEST, FASTEST = 0.1, 10.0


class Playback:
    """A position that moves on at a speed, as long as it is not held, up to what has been read of the session.

    Parameters
    ----------
    feed : Feed
        Of a recorded session.

    Attributes
    ----------
    position : float
        s.
    speed : float
        Session time over real time.
    is_held : bool
    """

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self.position, self.speed, self.is_held = 0.0, 1.0, False

    def advance(self, span: float) -> float:
        """Move on by `span` (s) of real time; gives the position. It holds at the end."""
        if not self.is_held:
            self.seek(self.position + self.speed * span)
            self.is_held = self.is_at_end
        return self.position

    @property
    def is_at_end(self) -> bool:
        """Whether nothing more can come."""
        return self.position >= (self._feed.end or 0.0)

    def pace(self, speed: float) -> None:
        """Go on at that speed, or the nearest that there is."""
        self.speed = min(max(speed, SLOWEST), FASTEST)

    def seek(self, position: float) -> None:
        """Go there, or to the nearest end of what has been read."""
        self.position = min(max(position, 0.0), self._feed.store.newest, self._feed.end or 0.0)
