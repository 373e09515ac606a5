"""Rows of numbers by time, the newest so many of them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FIRST = 1024
"""Rows that there is room for at first."""
Rows = tuple[NDArray[np.float64], NDArray[np.float32]]


class Table:
    """Named columns and a time for every row; the oldest rows make room for new ones.

    Memory is taken as rows come.

    Parameters
    ----------
    name : str
    columns : sequence of str
        Their unit at the end: ``x_m``.
    capacity : int
        Rows that are kept.

    Attributes
    ----------
    count : int
        Rows that ever came; they are numbered from 0 on.
    """

    def __init__(self, name: str, columns: Sequence[str], capacity: int) -> None:
        self.name, self.columns, self.count = name, tuple(columns), 0
        self._capacity = capacity
        self._times = np.zeros(min(capacity, FIRST))
        self._values = np.zeros((len(self._times), len(columns)), dtype=np.float32)

    @property
    def first(self) -> int:
        """Number of the oldest row that is kept."""
        return max(0, self.count - len(self._times))

    @property
    def newest(self) -> float:
        """Time of the newest row, s; minus infinity without one."""
        return float(self._times[(self.count - 1) % len(self._times)]) if self.count else -np.inf

    def append(self, time: float, values: Sequence[float]) -> None:
        """Add a row: `time` (s), values (columns,)."""
        if self.count == len(self._times) < self._capacity:
            self._grow(min(2 * self.count, self._capacity))
        place = self.count % len(self._times)
        self._times[place], self._values[place] = time, values
        self.count += 1

    def _grow(self, size: int) -> None:
        more = size - len(self._times)
        self._times = np.pad(self._times, (0, more))
        self._values = np.pad(self._values, ((0, more), (0, 0)))

    def until(self, time: float) -> int:
        """Number of the first row after `time` (s), the rows being in order."""
        size = len(self._times)
        return bisect_right(range(self.first, self.count), time, key=lambda row: self._times[row % size]) + self.first

    def rows(self, first: int, end: int) -> Rows:
        """Times (k,) and values (k, columns) of the rows from number `first` up to before `end`, as far as they are kept."""
        places = np.arange(max(first, self.first), min(end, self.count)) % len(self._times)
        return self._times[places], self._values[places]
