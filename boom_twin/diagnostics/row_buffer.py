"""Rows of numbers that arrive one by one, in arrays: what is looked at once a second is then made of no list of arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..types import SECOND, Array

INTERVAL = SECOND // 50  # ns, least time between two rows of a window


class RowBuffer:
    """Rows of `width` numbers with stamps (ns), in the order of arrival."""

    def __init__(self, width: int) -> None:
        self._stamps, self._rows = np.empty(64, np.int64), np.empty((64, width))
        self._first = self._end = 0

    def add(self, stamp: int, row: Array) -> None:
        """Add a row."""
        if self._end == len(self._stamps):
            self._make_room()
        self._stamps[self._end], self._rows[self._end] = stamp, row
        self._end += 1

    def _make_room(self) -> None:
        """Move all rows to the front of arrays that have room for as many again."""
        for name in ("_stamps", "_rows"):
            kept = getattr(self, name)[self._first :]
            setattr(self, name, np.concatenate([kept, np.empty_like(kept), np.empty_like(kept[:64])]))
        self._first, self._end = 0, self._end - self._first

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Stamps, shape (k,), ns; a view."""
        return self._stamps[self._first : self._end]

    @property
    def rows(self) -> Array:
        """Rows, shape (k, width); a view."""
        return self._rows[self._first : self._end]

    def forget(self, count: int) -> None:
        """Forget the oldest rows."""
        self._first += count
        if self._first == self._end:
            self._first = self._end = 0


class StampWindow(RowBuffer):
    """Rows of the last `window` (ns) by their stamps, at most one in every `INTERVAL`."""

    def __init__(self, window: int, width: int) -> None:
        super().__init__(width)
        self._window = window
        self._newest = -INTERVAL

    def is_due(self, stamp: int) -> bool:
        """Return True if no row was added within the `INTERVAL` before `stamp` (ns)."""
        return not 0 <= stamp - self._newest < INTERVAL

    def add(self, stamp: int, row: Array) -> None:
        """Add a row that `is_due`; all are forgotten if the clock was set back."""
        is_back, self._newest = stamp < self._newest, stamp
        self.forget(len(self.stamps) if is_back else int(np.searchsorted(self.stamps, stamp - self._window)))
        super().add(stamp, row)
