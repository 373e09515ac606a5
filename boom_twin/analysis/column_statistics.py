"""Mean, standard deviation and root mean square of the columns of a table that comes in parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..types import Array


class ColumnStatistics:
    """Mean, standard deviation and root mean square of all finite values of each column so far; `count` is their number.

    Parts are combined as by Chan et al. 1983, doi 10.1080/00031305.1983.10483115.
    """

    def __init__(self, columns: int) -> None:
        self.count: NDArray[np.int64] = np.zeros(columns, np.int64)
        self._mean, self._about_mean, self._squares = np.zeros((3, columns))

    def add(self, values: Array) -> None:
        """Take rows in, shape (k, columns); NaN is no value."""
        known = np.isfinite(values)
        own = known.sum(axis=0)
        total, number = self.count + own, np.maximum(own, 1)
        given = np.where(known, values, 0.0)
        mean = given.sum(axis=0) / number
        apart = np.where(own > 0, mean - self._mean, 0.0)
        about = np.where(known, values - mean, 0.0)
        shares = own / np.maximum(total, 1)
        self._about_mean += (about**2).sum(axis=0) + apart**2 * self.count * shares
        self._mean += apart * shares
        self._squares += (given**2).sum(axis=0)
        self.count = total

    @property
    def mean(self) -> list[float | None]:
        """Means; None where there is no value, as in the other statistics."""
        return self._told(self._mean)

    @property
    def deviation(self) -> list[float | None]:
        """Standard deviations, of the population."""
        return self._told(np.sqrt(self._about_mean / np.maximum(self.count, 1)))

    @property
    def rms(self) -> list[float | None]:
        """Root mean squares."""
        return self._told(np.sqrt(self._squares / np.maximum(self.count, 1)))

    def _told(self, found: Array) -> list[float | None]:
        return [float(value) if count else None for value, count in zip(found, self.count, strict=True)]
