"""What came by one stream since the last look."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import nan

import numpy as np

from ..records import Array, Sample
from .channel import NANO, Channel, Figures


class StreamWatch:
    """Counts messages as they come, and works out figures when asked; times in s, stamps in ns.

    Parameters
    ----------
    low, high : ndarray, shape (n,)
        Range of each channel, in the sensor's unit.
    monotonic : callable
        The time, s, of a clock that only goes forward.

    Attributes
    ----------
    count : int
        Messages, since the beginning.
    newest : int or None
        Stamp of the newest message.
    lag : float
        Least time from a stamp to its arrival since the last look but one, s, by two clocks that need not agree; NaN without
        messages. Differences of two streams' lags tell how their clocks are apart.
    """

    def __init__(self, low: Array, high: Array, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._monotonic = monotonic
        self._channels = [Channel(*bounds) for bounds in zip(low.tolist(), high.tolist(), strict=True)]
        self.count = 0
        self.begin(monotonic())

    def begin(self, now: float) -> None:
        """Listening begins; everything but the count is forgotten."""
        self.newest: int | None = None
        self._heard, self._told, self._least, self.lag = now, self.count, nan, nan
        self._samples: list[Sample] = []
        for channel in self._channels:
            channel.forget()

    def seen(self, stamp: int) -> None:
        """A message came."""
        self.count += 1
        self.newest = stamp
        self._heard = now = self._monotonic()
        lag = now - stamp * NANO
        if not lag >= self._least:
            self._least = lag

    def took(self, sample: Sample) -> None:
        """A message held this; one that is refused never gets here."""
        self._samples.append(sample)

    def age(self, now: float) -> float:
        """Time since the last message, or since listening began."""
        return now - self._heard

    def age_of(self, figures: Figures, now: float) -> float:
        """Time since the last reading of one channel, or since listening began; by stamps beyond the last message."""
        if self.newest is None or not figures.stamp:
            return self.age(now)
        return self.age(now) + max(0, self.newest - figures.stamp) * NANO

    def look(self, longest: float) -> list[Figures]:
        """The figures of every channel since the last look; `longest` (s) is the step between stamps that is allowed."""
        samples, self._samples = self._samples, []
        refused = max(0, self.count - self._told - len(samples))
        self._told = self.count
        self.lag, self._least = self._least, nan
        stamps = np.array([sample.stamp for sample in samples], dtype=np.int64)
        table = np.concatenate([np.zeros(0), *(sample.values for sample in samples)]).reshape(-1, len(self._channels))
        return [channel.look(stamps, table[:, i], refused, longest) for i, channel in enumerate(self._channels)]
