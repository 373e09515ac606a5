"""What SIGINT and SIGTERM do to a process. Needs no rclpy, so that it can be set up before anything else."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType


def on_stop_signal(act: Callable[[], None]) -> None:
    """From now on the first SIGINT or SIGTERM calls `act`, and further ones do nothing."""
    known = (signal.SIGINT, signal.SIGTERM)

    def stop(number: int, frame: FrameType | None) -> None:
        for each in known:
            signal.signal(each, signal.SIG_IGN)
        act()

    for each in known:
        signal.signal(each, stop)


class Stop:
    """A stop by SIGINT or SIGTERM: seen between two pieces of work, or KeyboardInterrupt where one takes too long.

    An exception in the midst of a callback is reported by rclpy as a fault of the callback.

    Attributes
    ----------
    asked : bool
        Whether a signal came.
    """

    LONGEST = 0.5
    """Time (s) for a piece of work to come to its end."""

    def __init__(self) -> None:
        self.asked = False
        on_stop_signal(self._ask)

    def _ask(self) -> None:
        self.asked = True
        signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_REAL, self.LONGEST)

    def over(self) -> None:
        """Interrupt nothing from now on: the process is ending."""
        signal.setitimer(signal.ITIMER_REAL, 0.0)
