"""A part of a session in time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import BagError
from ..messages.cdr_decoder import MessageBlock
from ..types import NANO

NEVER = 2**64 - 1  # log time after all others, ns


@dataclass(frozen=True, slots=True)
class TimeWindow:
    """A part of a session, by the log times of its messages.

    Attributes
    ----------
    start : float
        Time after the first message of the topics that are read, s.
    duration : float or None
        Length, s; None is to the end of the session.
    """

    start: float = 0.0
    duration: float | None = None

    def share(self, length: float) -> float:
        """Return the share of a session of `length` (s) that lies in the window, 0 to 1."""
        left = max(0.0, length - self.start)
        return min(left, left if self.duration is None else self.duration) / length if length > 0.0 else 1.0

    def cut(self, blocks: Iterable[MessageBlock], path: Path) -> Iterator[MessageBlock]:
        """Yield the messages inside the window. Blocks after its end are not read.

        Raise BagError if no message is in the window.
        """
        first: int | None = None
        is_empty, newest = True, 0.0
        for block in blocks:
            first = int(block.log_times[0]) if first is None else first
            newest = (int(block.log_times[-1]) - first) * NANO
            begin, end = np.searchsorted(block.log_times, np.array(self.bounds(first), np.uint64))
            if begin < end:
                is_empty = False
                yield block.chosen(slice(int(begin), int(end)))
            if end < len(block):
                break
        if is_empty:
            told = "" if self.duration is None else f" to {self.start + self.duration:g} s"
            raise BagError(
                f"{path}: no message from {self.start:g} s{told} on; the session lasts {newest:.1f} s. Begin earlier."
            )

    def bounds(self, first: int) -> tuple[int, int]:
        """Return the first log time (ns) in the window and the first one after it, for a session that begins at `first`."""
        begin = min(NEVER, first + round(self.start / NANO))
        return begin, NEVER if self.duration is None else min(NEVER, begin + round(self.duration / NANO))


WHOLE = TimeWindow()  # window of the whole session
