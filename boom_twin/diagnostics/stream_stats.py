"""Statistics of one input stream and of each of its channels since the last look."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable
from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Array, Sample

LONGEST_PAUSE = 10.0  # longest step of stamps (s) that is a pause of the sensor; a longer one is a jump of its clock


@dataclass(frozen=True, slots=True)
class ChannelStats:
    """Statistics of one sensor since the last look."""

    value: float  # newest reading, in the sensor's unit; NaN before the first one
    stamp: int  # stamp of `value`, ns; 0 before the first one
    rate: float  # readings a second, by their stamps; NaN if fewer than two
    gap: float  # longest step between their stamps, s
    gaps: int  # steps longer than permitted, since listening began
    missing: float  # share of the messages without a finite value; NaN without messages
    outside: float  # share of the messages with a value out of range; NaN without messages
    unchanged: int  # consecutive readings, up to the newest, that repeat the one before


class Channel:
    """Computation of the statistics of one sensor; `low` and `high` are its range, in its unit."""

    def __init__(self, low: float = -inf, high: float = inf) -> None:
        self._low, self._high = low, high
        self._value, self._stamp, self._unchanged, self._gaps = nan, 0, 0, 0

    def look(self, stamps: NDArray[np.int64], values: Array, refused: int, longest: float) -> ChannelStats:
        """Return the statistics of `values` (k,) with `stamps` (k,) in ns; NaN where the message had no value.

        `refused` further messages had no usable value; `longest` (s) is the largest permitted step of stamps.
        """
        messages, usable = len(values) + refused, np.isfinite(values)
        stamps, values, steps = stamps[usable], values[usable], np.zeros(0)
        if len(values):
            steps = np.diff(stamps, prepend=self._stamp or stamps[0]) * NANO
            steps = steps[(steps > 0.0) & (steps <= LONGEST_PAUSE)]
            changes = np.flatnonzero(np.diff(values, prepend=self._value) != 0.0)  # also the first reading ever
            self._unchanged = len(values) - 1 - int(changes[-1]) if len(changes) else self._unchanged + len(values)
            self._value, self._stamp = float(values[-1]), int(stamps[-1])
        outside = np.count_nonzero((values < self._low) | (values > self._high))
        total = float(steps.sum())
        self._gaps += int(np.count_nonzero(steps > longest))
        return ChannelStats(
            value=self._value,
            stamp=self._stamp,
            rate=len(steps) / total if total > 0.0 else nan,
            gap=float(steps.max(initial=0.0)),
            gaps=self._gaps,
            missing=1.0 - len(values) / messages if messages else nan,
            outside=outside / messages if messages else nan,
            unchanged=self._unchanged,
        )


class Rows:
    """Rows of `width` numbers in plain memory, which Python's garbage collector need not search."""

    def __init__(self, width: int) -> None:
        self._width, self._numbers = width, array("d")

    def append(self, row: Array) -> None:
        """Append a row, shape (width,)."""
        self._numbers.frombytes(row.tobytes())

    def table(self) -> Array:
        """Return all rows, shape (k, width). No row can be added while the result exists."""
        return np.frombuffer(self._numbers).reshape(-1, self._width)


class StreamWatch:
    """Statistics of one stream, computed when `look` is called. Times are in s, stamps in ns.

    Attributes
    ----------
    lag : float
        Least time from stamp to arrival between the last two looks, s; NaN without messages. It contains an unknown clock
        offset. The difference of two streams' lags is the offset between their clocks.
    """

    def __init__(self, ranges: Array, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._ranges, self._monotonic = ranges.tolist(), monotonic
        self.count = 0  # messages, since the beginning
        self.begin()

    def begin(self) -> None:
        """Start listening; reset everything but the count."""
        self.newest: int | None = None
        self._heard, self._looked_count, self._least, self.lag = self._monotonic(), self.count, nan, nan
        self._counted = nan, 0
        self._channels = [Channel(*bounds) for bounds in self._ranges]
        self._stamps, self._values = array("q"), Rows(len(self._channels))  # of samples

    def seen(self, stamp: int) -> None:
        """Count a message."""
        self.count += 1
        self.newest = stamp
        self._heard = now = self._monotonic()
        lag = now - stamp * NANO
        if not lag >= self._least:
            self._least = lag

    def took(self, sample: Sample) -> None:
        """Take the sample of a message. A refused message has none."""
        self._stamps.append(sample.stamp)
        self._values.append(sample.values)

    def age(self, now: float) -> float:
        """Return the time since the last message, or since listening began."""
        return now - self._heard

    def age_of(self, stats: ChannelStats, now: float) -> float:
        """Return the time since a channel's last reading, or since listening began.

        Up to the newest message, time is taken from stamps.
        """
        if self.newest is None or not stats.stamp:
            return self.age(now)
        return self.age(now) + max(0, self.newest - stats.stamp) * NANO

    def arrival_rate(self, now: float) -> float:
        """Return the messages a second since the last call; NaN at the first."""
        (time, count), self._counted = self._counted, (now, self.count)
        return (self.count - count) / (now - time) if now > time else nan

    def look(self, longest: float) -> list[ChannelStats]:
        """Return the statistics of every channel since the last look; `longest` (s) is the largest permitted step of stamps."""
        stamps, table = np.frombuffer(self._stamps, np.int64), self._values.table()
        self._stamps, self._values = array("q"), Rows(len(self._channels))
        refused = max(0, self.count - self._looked_count - len(stamps))
        self._looked_count = self.count
        self.lag, self._least = self._least, nan
        return [channel.look(stamps, table[:, i], refused, longest) for i, channel in enumerate(self._channels)]
