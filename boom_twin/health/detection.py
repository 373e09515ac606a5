"""Detect deviations: test whether innovations are white and of unit variance.

Per channel a two-sided CUSUM (Page 1954) for a lasting deviation, and the sum of squares over a window for a larger spread.
Thresholds follow from the rate of false alarms that is stated: that of the CUSUM by Siegmund's approximation of its run length,

    E[run] = (exp(2 k b) - 1 - 2 k b) / (2 k^2),   b = h + 1.166,

k being the allowance and h the threshold; that of the window by the quantile of chi-square.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..kernels.elements.pin_contact import bisect
from ..kernels.jit import SameTypes
from ..types import Array
from .deviation_sums import ALLOWANCE, WINDOW, follow_deviations

EXCESS = 1.5  # times the variance that model error may have


class Detector:
    """Watches the innovations of all channels.

    Parameters
    ----------
    channels : int
    block : float
        Time between innovations, s.
    false_alarms : float
        Of all channels together, per s.
    """

    def __init__(self, channels: int, block: float, false_alarms: float) -> None:
        rate = false_alarms * block / (4.0 * channels)  # per test: two sides, and as many for the window as for the CUSUM
        self.threshold = cusum_threshold(1.0 / rate)
        self.limit = EXCESS * chi_square_exceeded(2.0 * rate)
        self._sums, self._began = np.zeros((2, channels)), np.zeros((2, channels), dtype=np.int64)
        self._squares = np.zeros((WINDOW, channels))
        self._lasting, self._window = 0.0, 0.0
        self._count = 0
        self._follow = SameTypes(follow_deviations)

    def take(self, normal: Array) -> None:
        """Innovations of one block, shape (channels,), NaN where nothing was measured."""
        self._count += 1
        self._lasting, self._window = self._follow(self._sums, self._began, self._squares, normal, self._count)

    @property
    def levels(self) -> Array:
        """Of each channel: 1 and above is an alarm; shape (channels,)."""
        window = self._squares.sum(axis=0) if self._count >= WINDOW else 0.0
        return np.asarray(np.maximum(self._sums.max(axis=0) / self.threshold, window / self.limit))

    @property
    def suspicion(self) -> float:
        """How near the nearest channel is to an alarm; 0 while nothing lasts and no spread is half of what is allowed."""
        lasting, window = self._lasting / self.threshold, self._window / self.limit if self._count >= WINDOW else 0.0
        return max(lasting, window if window > 0.5 else 0.0)

    def blocks_since(self, channel: int) -> int:
        """Blocks since the deviation of a channel began, as far as it can be told."""
        up, down = self._sums[:, channel].tolist()
        row = 0 if up >= down else 1
        if max(up, down) < self.threshold:
            return WINDOW
        return self._count - int(self._began[row, channel]) + 1

    def reset(self, channels: NDArray[np.bool_] | None = None) -> None:
        """Begin anew, at some channels or all."""
        which = np.ones(self._sums.shape[1], dtype=bool) if channels is None else channels
        self._sums[:, which], self._squares[:, which] = 0.0, 0.0
        self._lasting, self._window = float(self._sums.max()), float(self._squares.sum(axis=0).max())


def cusum_threshold(run: float) -> float:
    """Threshold of a one-sided CUSUM whose mean time between false alarms is `run` steps."""

    def excess(h: float) -> float:
        b = 2.0 * ALLOWANCE * (h + 1.166)
        return math.expm1(b) - b - 2.0 * ALLOWANCE**2 * run

    return bisect(lambda h: excess(h) < 0.0, 0.0, 100.0)


def chi_square_exceeded(probability: float) -> float:
    """What a chi-square of `WINDOW` degrees of freedom, an even number, exceeds with this probability.

    With x half of it and m half the degrees, the probability is exp(-x) (1 + x + .. + x^(m-1)/(m-1)!). `scipy.special` has it
    too, but takes longer to import than all else that a twin starts with.
    """

    def exceeded(x: float) -> float:
        return math.exp(-x) * sum(x**k / math.factorial(k) for k in range(WINDOW // 2))

    return 2.0 * bisect(lambda x: exceeded(x) > probability, 0.0, 500.0)
