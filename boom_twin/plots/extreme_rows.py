"""Thin out a growing table so that a picture of it shows all extremes: the least and the largest of every bin are kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..types import Array


class ExtremeRows:
    """Rows of some arrays side by side: all while they are few, of more the extremes in bins of consecutive rows.

    Of every bin those rows stay in which a key has its least or its largest value, so that curves drawn through what is
    left span in each bin what all rows spanned. Bins get twice as wide whenever `most` rows are not enough, each of them
    two earlier ones: the extremes of a wide bin are among those of its halves.

    Parameters
    ----------
    most : int
        Rows from which on they are thinned out.
    keys : sequence of int
        Of the arrays whose extremes are to be seen, each (k,) or (k, c).

    Attributes
    ----------
    count : int
        Rows that ever came.
    columns : list of ndarray
        The arrays, with the rows that are left; none before the first `add`.
    """

    def __init__(self, most: int, keys: Sequence[int]) -> None:
        self.count = 0
        self.columns: list[Array] = []
        self._most, self._keys, self._width = most, keys, 1
        self._numbers: NDArray[np.int64] = np.zeros(0, np.int64)

    def add(self, columns: Sequence[Array]) -> None:
        """Append rows, shapes (k, ..)."""
        rows = len(columns[0])
        self._numbers = np.concatenate([self._numbers, self.count + np.arange(rows)])
        self.count += rows
        held = self.columns or [column[:0] for column in columns]
        self.columns = [np.concatenate(pair) for pair in zip(held, columns, strict=True)]

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
        while len(self._numbers) - int(kept.sum()) > self._most // 2 and self._width < self.count:
            self._width *= 2
            kept = self._take_away(kept)

    def _take_away(self, kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Remove rows with the present width of bins; return which of the rows that are left are kept anyhow."""
        stays = kept | extremes(self._numbers // self._width, [self.columns[key] for key in self._keys])
        self._numbers, self.columns = self._numbers[stays], [column[stays] for column in self.columns]
        return kept[stays]


def extremes(bins: NDArray[np.int64], keys: Sequence[Array]) -> NDArray[np.bool_]:
    """Return True for the rows with the least or the largest value of a key in their bin, the first of equal ones; shape (k,).

    Parameters
    ----------
    bins : ndarray of int, shape (k,)
        Of every row, ascending.
    keys : sequence of ndarray, shapes (k,) or (k, c)
        NaN is no value.
    """
    starts = np.flatnonzero(np.diff(bins, prepend=-1))
    sizes = np.diff(starts, append=len(bins))
    found = np.zeros(len(bins), bool)
    for table in keys:
        for column in table.reshape(len(bins), -1).T:
            for extreme in (np.fmin, np.fmax):
                rows = np.flatnonzero(column == np.repeat(extreme.reduceat(column, starts), sizes))
                _, first = np.unique(bins[rows], return_index=True)
                found[rows[first]] = True
    return found
