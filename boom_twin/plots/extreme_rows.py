"""Thin out a growing table so that a picture of it shows all extremes: the least and the largest of every bin are kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..types import Array


class ExtremeRows:
    """Table of arrays side by side, `columns`, that keeps all rows while they are few, and of more rows the extremes in bins.

    A row stays if it has the least or the largest value of a key in its bin of consecutive rows. So a curve through the rows
    that are left spans in every bin what all rows spanned. Bins get twice as wide whenever `most` rows are not enough: the
    extremes of a wide bin are among those of its halves. `keys` are the columns whose extremes are to be seen.
    """

    def __init__(self, most: int, keys: Sequence[str]) -> None:
        self.columns: dict[str, Array] = {}
        self._most, self._keys, self._width, self._count = most, keys, 1, 0
        self._numbers: NDArray[np.int64] = np.zeros(0, np.int64)

    def add(self, columns: Mapping[str, Array]) -> None:
        """Append rows, shapes (k, ..)."""
        rows = len(next(iter(columns.values())))
        self._numbers = np.concatenate([self._numbers, self._count + np.arange(rows)])
        self._count += rows
        held = self.columns or {name: column[:0] for name, column in columns.items()}
        self.columns = {name: np.concatenate([held[name], column]) for name, column in columns.items()}

    @property
    def is_thin(self) -> bool:
        """Return True if rows have been removed."""
        return self._width > 1

    @property
    def is_full(self) -> bool:
        """Return True if rows must be removed."""
        return len(self._numbers) > self._most

    def thin(self, kept: NDArray[np.bool_]) -> None:
        """Remove rows until at most half of the permitted number are left, not counting those `kept`, bool (k,), which stay."""
        kept = self._take_away(kept)
        while len(self._numbers) - int(kept.sum()) > self._most // 2 and self._width < self._count:
            self._width *= 2
            kept = self._take_away(kept)

    def _take_away(self, kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Remove rows with the present width of bins; return which of the rows that are left are kept anyhow."""
        stays = kept | _extremes(self._numbers // self._width, [self.columns[key] for key in self._keys])
        self._numbers = self._numbers[stays]
        self.columns = {name: column[stays] for name, column in self.columns.items()}
        return kept[stays]


def _extremes(bins: NDArray[np.int64], keys: Sequence[Array]) -> NDArray[np.bool_]:
    """Return True for the first rows with the least or the largest value of a key in their bin; NaN is no value.

    `bins` (k,) ascend; keys have the shape (k,) or (k, c).
    """
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    sizes = np.diff(starts, append=len(bins))
    found = np.zeros(len(bins), bool)
    for column in (column for table in keys for column in table.reshape(len(bins), -1).T):
        for extreme in (np.fmin, np.fmax):
            rows = np.flatnonzero(column == np.repeat(extreme.reduceat(column, starts), sizes))
            _, first = np.unique(bins[rows], return_index=True)
            found[rows[first]] = True
    return found
