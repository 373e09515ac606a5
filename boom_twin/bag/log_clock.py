"""Detect that a recorder's clock was set back within a file. The order of the file is then the order of messages."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..messages.message_block import Integers, MessageBlock

Piece = tuple[Integers, Integers, NDArray[np.uint64]]
"""Places, channels and log times (ns) of many messages in the order of the file."""
OUT_OF_ORDER = 0.25
"""Share of steps back among a file's messages at which its order is not that of recording; a random order has half."""
MAJORITY = 0.5  # share of messages in topics that step back at which the clock is the cause, because all topics share the clock


@dataclass(frozen=True, slots=True, eq=False)
class LogClock:
    """Steps back of the clock of log times, in the order of a file.

    A recorder writes a topic's messages as they come. If the log times of a topic step back and continue from there, the
    clock was set back. If they step back often, or for one message, the file was not written in order, and its log times
    are sound.
    """

    places: Integers  # place of the first message after every step; shape (k,)
    shifts: Integers  # total shift of the clock after every step, ns; shape (k,)

    @property
    def is_set_back(self) -> bool:
        """Return True if the clock was set back, so that the order of the file is used instead of that of log times."""
        return len(self.places) > 0

    @classmethod
    def of(cls, pieces: Callable[[], Iterable[Piece]]) -> LogClock:
        """Return the clock of a file, whose `pieces` are read twice."""
        counts, steps, lasting = Counter[int](), Counter[int](), Counter[int]()
        newest: defaultdict[int, NDArray[np.int64]] = defaultdict(lambda: np.zeros(0, np.int64))
        for _, channels, times in pieces():
            for channel in np.unique(channels).tolist():
                own = np.concatenate([newest[channel], times[channels == channel].astype(np.int64)])
                back = own[1:-1] < own[:-2]
                counts[channel] += len(own) - len(newest[channel])
                steps[channel] += int(back.sum())
                lasting[channel] += int((back & (own[2:] < own[:-2])).sum())
                newest[channel] = own[-2:]
        known = {channel for channel, count in lasting.items() if count and steps[channel] < OUT_OF_ORDER * counts[channel]}
        is_set_back = sum(counts[channel] for channel in known) > MAJORITY * counts.total()
        return cls(*_steps(pieces())) if is_set_back else NEVER_SET_BACK

    @property
    def total(self) -> int:
        """Total time by which the clock was set back, ns."""
        return int(self.shifts[-1]) if self.is_set_back else 0

    def corrected(self, block: MessageBlock, places: Integers) -> MessageBlock:
        """Return the block with log times of a clock that was not set back, rising in the order of the file."""
        return replace(block, log_times=np.maximum.accumulate(self.times(block.log_times, places)))

    def times(self, log_times: NDArray[np.uint64], places: Integers) -> NDArray[np.uint64]:
        """Return the log times of messages at `places` by a clock that was not set back."""
        shifts = np.concatenate([[0], self.shifts])[np.searchsorted(self.places, places, "right")]
        return np.asarray(log_times + shifts.astype(np.uint64))


NEVER_SET_BACK = LogClock(np.zeros(0, np.int64), np.zeros(0, np.int64))


def _steps(pieces: Iterable[Piece]) -> tuple[Integers, Integers]:
    """Return places and shifts of all steps back. A step is at a message before the one before it in its channel."""
    places, shifts, newest, shift = list[int](), list[int](), 0, 0
    last: dict[int, int] = {}
    for piece in pieces:
        for place, channel, time in zip(*(column.tolist() for column in piece), strict=True):
            time += shift
            if time < last.get(channel, 0):
                shift += newest - time
                time = newest
                places.append(place)
                shifts.append(shift)
            last[channel], newest = time, max(newest, time)
    return np.array(places, np.int64), np.array(shifts, np.int64)
