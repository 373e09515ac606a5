"""Progress of a long run: a bar on a terminal."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class ProgressBar(Protocol):
    """Receiver of a run's progress; ``tqdm`` is one."""

    def update(self, n: float, /) -> object:
        """Add `n` to what was done."""

    def close(self) -> object:
        """Close the display after the last step."""


Progress = Callable[[int], ProgressBar]


def progress_of(total: int, unit: str, name: str, done: int = 0) -> ProgressBar:
    """Return a progress bar on stderr, which shows nothing if that is no terminal."""
    from tqdm import tqdm

    bar: ProgressBar = tqdm(total=total, initial=done, unit=unit, desc=name, mininterval=0.2, disable=None)
    return bar
