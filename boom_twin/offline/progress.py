"""Progress of a long run on stderr: a bar on a terminal, otherwise a line per 10 %."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Protocol


class ProgressBar(Protocol):
    """Receiver of a run's progress; ``tqdm`` is one."""

    def update(self, n: float, /) -> object:
        """Add `n` to what was done."""

    def close(self) -> object:
        """Close the display after the last step."""


Progress = Callable[[int], ProgressBar]


class TenthLines:
    """Progress as one line per 10 %.

    Parameters
    ----------
    total : int
        Number of units in the whole run.
    unit, name : str
        Plural name of the units, and name of the command.
    """

    def __init__(self, total: int, unit: str, name: str, done: int = 0) -> None:
        self._total, self._unit, self._name, self._done = total, unit, name, float(done)
        self._told = self._tenths

    @property
    def _tenths(self) -> int:
        return min(10, int(10 * self._done / self._total)) if self._total else 0

    def update(self, n: float, /) -> None:
        """Add `n` units, and print a line if a further 10 % is done."""
        self._done += n
        if self._tenths > self._told:
            self._told = self._tenths
            done = min(round(self._done), self._total)
            print(f"{self._name}: {10 * self._told} %, {done} of {self._total} {self._unit}", file=sys.stderr, flush=True)

    def close(self) -> None:
        """Do nothing; `update` has printed the last line."""


def progress_of(total: int, unit: str, name: str, done: int = 0) -> ProgressBar:
    """Return a progress bar if stderr is a terminal, else `TenthLines`."""
    if not sys.stderr.isatty():
        return TenthLines(total, unit, name, done)
    from tqdm import tqdm

    bar: ProgressBar = tqdm(total=total, initial=done, unit=unit, desc=name, mininterval=0.2)
    return bar
