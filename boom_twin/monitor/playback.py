"""Where one viewer is in a recorded session."""

from __future__ import annotations

SLOWEST, FASTEST = 0.1, 10.0


class Playback:
    """A position that moves on at a speed, as long as it is not held.

    Parameters
    ----------
    end : float
        Of the session, s.

    Attributes
    ----------
    position : float
        s.
    speed : float
        Session time over real time.
    is_held : bool
    """

    def __init__(self, end: float) -> None:
        self.end = end
        self.position, self.speed, self.is_held = 0.0, 1.0, False

    def advance(self, span: float) -> float:
        """Move on by `span` (s) of real time; gives the position. It holds at the end."""
        if not self.is_held:
            self.position = min(self.position + self.speed * span, self.end)
            self.is_held = self.position >= self.end
        return self.position

    def pace(self, speed: float) -> None:
        """Go on at that speed, or the nearest that there is."""
        self.speed = min(max(speed, SLOWEST), FASTEST)

    def seek(self, position: float) -> None:
        """Go there, or to the nearest end."""
        self.position = min(max(position, 0.0), self.end)
