"""What makes residuals white: a vector autoregression of their noise.

The noise of block means is not white: the sensors' own is, but noise of the strokes shakes the boom's natural modes, which
ring for seconds and move all channels together. Its realisations, made by the very model, are fitted by

    e_t = sum_k A_k e_(t-k) + L w_t,    k = 1 .. p,

with w of unit variance and white (Luetkepohl, New Introduction to Multiple Time Series Analysis, 2005, ch. 3, least squares).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..records import Array

MEMORY = 2.0  # s, in which a boom's slowest swing is told from others near it


@dataclass(frozen=True)
class Whitening:
    """The filter for c channels: `matrix` (c, c) is the inverse of L, `past` (p, c, c) holds A_1 .. A_p."""

    matrix: Array
    past: Array

    def __call__(self, residuals: Array) -> Array:
        """White residuals of b blocks in a row, shape (.., b, c) to (.., b - p, c); 0 where a value it needs is missing."""
        order, count = len(self.past), residuals.shape[-2]
        left = residuals[..., order:, :].copy()
        for k, gain in enumerate(self.past, start=1):
            left -= residuals[..., order - k : count - k, :] @ gain.T
        return np.asarray(np.nan_to_num(left @ self.matrix.T, nan=0.0))

    def of_constant(self, values: Array) -> Array:
        """What white residuals a constant (.., c) has in every block."""
        return np.asarray((values - values @ self.past.sum(axis=0).T) @ self.matrix.T)


def whitening_of(noise: Sequence[Array], length: float) -> Whitening:
    """Fit the filter to realisations, each of shape (k, b, c), of blocks of `length` (s)."""
    order = max(1, round(MEMORY / length))
    past = np.concatenate([_lagged(each, order) for each in noise])
    now = np.concatenate([each[:, order:].reshape(-1, each.shape[-1]) for each in noise])
    gains = np.linalg.solve(past.T @ past, past.T @ now)
    left = now - past @ gains
    channels = now.shape[1]
    factor = np.linalg.cholesky(left.T @ left / len(left))
    return Whitening(np.linalg.inv(factor), gains.T.reshape(channels, order, channels).swapaxes(0, 1))


def _lagged(noise: Array, order: int) -> Array:
    """The values before every one, newest first, shape (k (b - p), p c)."""
    count = noise.shape[1]
    columns = [noise[:, order - k : count - k] for k in range(1, order + 1)]
    return np.concatenate(columns, axis=2).reshape(-1, order * noise.shape[2])
