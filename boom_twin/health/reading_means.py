"""Slow means of what sensors read and of what the model expects of them, beside each other."""

from __future__ import annotations

import numpy as np

from ..types import Array

WINDOW = 2.0  # s, time constant of the means
ENOUGH = 0.6  # of their weight: after 1.8 s


class ReadingMeans:
    """Means over the last `WINDOW`, of the channels of one stream.

    Attributes
    ----------
    read, expected : ndarray, shape (channels,)
        Weighted sums that begin at 0, in the unit of the readings: divided by `weight`, they are means.
    weight : ndarray, shape (channels,)
        From 0 to 1.
    """

    def __init__(self, channels: int) -> None:
        self.read, self.expected, self.weight = np.zeros(channels), np.zeros(channels), np.zeros(channels)

    def take(self, raw: Array, left: Array, span: float) -> tuple[Array, Array]:
        """Take the readings of a block.

        Parameters
        ----------
        raw, left : ndarray, shape (k, channels)
            As measured, and less what the model has; NaN where there is none.
        span : float
            Length of the block, s.

        Returns
        -------
        share, off : ndarray, shape (channels,)
            Weight of the block, 0 of channels without a reading; mean of `left`.
        """
        known = np.isfinite(left)
        counts = known.sum(axis=0)
        read = np.where(known, raw, 0.0).sum(axis=0) / np.maximum(counts, 1)
        off = np.where(known, left, 0.0).sum(axis=0) / np.maximum(counts, 1)
        share = np.where(counts > 0, min(1.0, span / WINDOW), 0.0)
        self.read += share * (read - self.read)
        self.expected += share * (read - off - self.expected)
        self.weight += share * (1.0 - self.weight)
        return share, off
