"""Checks of something that follows with a delay: a page that draws, a process that answers."""

from __future__ import annotations

import time
from collections.abc import Callable

NOT_YET = (AssertionError, IndexError, KeyError, StopIteration, ValueError)


def eventually(check: Callable[[], None], patience: float = 20.0) -> None:
    """Call `check` until it raises nothing, for at most `patience` seconds; then what it raised last is raised."""
    end = time.monotonic() + patience
    while True:
        try:
            return check()
        except NOT_YET:
            if time.monotonic() > end:
                raise
        time.sleep(0.1)
