"""What sensors read too much, from which stamp on."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import numpy as np

from .records import Array, Stream

KEPT = 16  # sets of zeros that late samples may still need


class Zeros:
    """The zeros of all sensors.

    Parameters
    ----------
    channels : dict of Stream to tuple of str
        See `boom_twin.records.channels_of`.

    Attributes
    ----------
    values : dict of str to float
        The newest ones, by channel: m, rad, m/s^2.
    """

    def __init__(self, channels: Mapping[Stream, tuple[str, ...]]) -> None:
        self._channels = channels
        self.values: dict[str, float] = {}
        self._past: deque[tuple[int, dict[Stream, Array]]] = deque([(0, {})], maxlen=KEPT)

    def put(self, stamp: int, values: Mapping[str, float]) -> bool:
        """Others from `stamp` (ns) on; samples of earlier stamps keep what they had. Tells whether those of strokes differ."""
        before, self.values = self.values, dict(values)
        rows = {}
        for stream, names in self._channels.items():
            row = np.array([self.values.get(name, 0.0) for name in names])
            if row.any():
                rows[stream] = row
        self._past.append((stamp, rows))
        return any(before.get(name) != values.get(name) for name in self._channels[Stream.STROKES])

    def forget_past(self) -> None:
        """The newest zeros hold for every stamp."""
        rows = self._past[-1][1]
        self._past.clear()
        self._past.append((0, rows))

    def of(self, stream: Stream, stamp: int) -> Array | None:
        """What is to be taken from a sample; None where nothing is."""
        for since, rows in reversed(self._past):
            if since <= stamp:
                return rows.get(stream)
        return None
