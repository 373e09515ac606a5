"""The readings of one sensor, in figures."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from ..records import Array

LONGEST = 10.0
"""Longest step between two stamps (s) that is taken for a pause of the sensor, and not for a jump of its clock."""

NANO = 1e-9


@dataclass(frozen=True, slots=True)
class Figures:
    """One sensor since the last look.

    Attributes
    ----------
    value : float
        Newest reading, in the sensor's unit; NaN before the first one.
    stamp : int
        Its stamp, ns.
    rate : float
        Readings a second, by their stamps; NaN where fewer than two are known.
    gap : float
        Longest step between their stamps, s.
    gaps : int
        Steps longer than is allowed, since listening began.
    missing, outside : float
        Share of the messages without a finite value, and with one out of range; NaN without messages.
    unchanged : int
        Readings, up to the newest, that repeat the one before.
    """

    value: float
    stamp: int
    rate: float
    gap: float
    gaps: int
    missing: float
    outside: float
    unchanged: int


class Channel:
    """Works out the figures of one sensor.

    Parameters
    ----------
    low, high : float
        Its range, in its unit.
    """

    def __init__(self, low: float = -inf, high: float = inf) -> None:
        self._low, self._high = low, high
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._value, self._stamp, self._unchanged, self._gaps = nan, 0, 0, 0

    def look(self, stamps: NDArray[np.int64], values: Array, refused: int, longest: float) -> Figures:
        """The figures of what came since the last look.

        Parameters
        ----------
        stamps : ndarray of int, shape (k,)
            ns.
        values : ndarray, shape (k,)
            In the sensor's unit; NaN where the message had none.
        refused : int
            Messages that held nothing of use for any sensor.
        longest : float
            Step between stamps that is allowed, s.
        """
        messages, usable = len(values) + refused, np.isfinite(values)
        stamps, values = stamps[usable], values[usable]
        outside = np.count_nonzero((values < self._low) | (values > self._high))
        steps = self._take(stamps, values)
        total = float(steps.sum())
        self._gaps += int(np.count_nonzero(steps > longest))
        return Figures(
            value=self._value,
            stamp=self._stamp,
            rate=len(steps) / total if total > 0.0 else nan,
            gap=float(steps.max(initial=0.0)),
            gaps=self._gaps,
            missing=1.0 - len(values) / messages if messages else nan,
            outside=outside / messages if messages else nan,
            unchanged=self._unchanged,
        )

    def _take(self, stamps: NDArray[np.int64], values: Array) -> Array:
        """Remember the newest reading; gives the steps between the stamps, s, without those that are no pause."""
        if not len(values):
            return np.zeros(0)
        steps = np.diff(stamps, prepend=self._stamp or stamps[0]) * NANO
        changes = np.flatnonzero(np.diff(values, prepend=self._value) != 0.0)  # also the first reading ever
        self._unchanged = len(values) - 1 - int(changes[-1]) if len(changes) else self._unchanged + len(values)
        self._value, self._stamp = float(values[-1]), int(stamps[-1])
        return steps[(steps > 0.0) & (steps <= LONGEST)]
