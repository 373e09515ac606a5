"""Checks of something that follows with a delay: a page that draws, a process that answers."""

from __future__ import annotations

import time
from collections.abc import Callable

NOT_YET = (AssertionError, IndexError, KeyError, StopIteration, ValueError)


def eventually(check: Callable[[], None], patience: float = 20.0) -> None:
    """Call `check` until it raises nothing; what it raises in a call that began after `patience` seconds is raised.

    So a check that is slow on a busy machine has a second call, on what has come since.
    """
    end = time.monotonic() + patience
    while True:
        is_last = time.monotonic() > end
        try:
            return check()
        except NOT_YET:
            if is_last:
                raise
        time.sleep(0.1)
