"""Progress of a long run: a line on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Protocol

INTERVAL = 0.2  # s, between two prints of the line


class ProgressBar(Protocol):
    """Receiver of a run's progress; a bar of the package tqdm is one."""

    def update(self, n: float, /) -> object:
        """Add `n` to what was done."""

    def close(self) -> object:
        """Close the display after the last step."""


Progress = Callable[[int], ProgressBar]


class ProgressLine:
    """Line on stderr with the share done and the time left; nothing is shown if stderr is no terminal."""

    def __init__(self, total: float, unit: str, name: str, done: float = 0.0) -> None:
        self.total, self.unit, self.name, self.done = total, unit, name, done
        self.is_shown = sys.stderr.isatty()
        self._before, self._began, self._printed = done, time.monotonic(), 0.0

    def update(self, n: float, /) -> None:
        self.done += n
        if self.is_shown and time.monotonic() - self._printed > INTERVAL:
            self.show()

    def show(self, end: str = "") -> None:
        """Print the line over the one before."""
        self._printed = time.monotonic()
        speed = (self.done - self._before) / max(self._printed - self._began, 1e-9)
        left = f", {(self.total - self.done) / speed:.0f} s left" if speed > 0.0 else ""
        line = f"{self.name}: {self.done / max(self.total, 1e-9):4.0%}, {self.done:.0f} of {self.total:.0f} {self.unit}{left}"
        print(f"\r{line:<79}", end=end, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Print the line a last time and end it."""
        if self.is_shown:
            self.show("\n")
