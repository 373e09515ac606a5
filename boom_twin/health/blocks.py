"""Gathers what is predicted and measured into blocks of 0.1 s, by stamps."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from ..records import Array, Prediction, Residuals, Stream

BLOCK = 100_000_000  # ns
GRACE = 100_000_000  # ns that a block waits for late samples
NANO = 1e-9


@dataclass(slots=True)
class Block:
    """What came within one block.

    Attributes
    ----------
    number : int
        Its stamps over `BLOCK`.
    predictions : list of Prediction
    strokes : list of ndarray
        As measured, m, one for each prediction.
    angles, forces : list of (Residuals, ndarray)
        With what was measured (rad, m/s^2).
    """

    number: int
    predictions: list[Prediction] = field(default_factory=list)
    strokes: list[Array] = field(default_factory=list)
    angles: list[tuple[Residuals, Array]] = field(default_factory=list)
    forces: list[tuple[Residuals, Array]] = field(default_factory=list)

    @property
    def end(self) -> int:
        """Stamp (ns) at which it ends."""
        return (self.number + 1) * BLOCK


class Blocks:
    """Open blocks, in the order of time."""

    def __init__(self) -> None:
        self._open: deque[Block] = deque()
        self._closed = -1

    def predicted(self, prediction: Prediction, strokes: Array) -> None:
        """A prediction with the strokes (m) as they were measured."""
        block = self._at(prediction.stamp)
        if block is not None:
            block.predictions.append(prediction)
            block.strokes.append(strokes)

    def measured(self, residuals: Residuals, values: Array) -> None:
        """Residuals of one sample with its values."""
        block = self._at(residuals.stamp)
        if block is not None:
            (block.angles if residuals.stream is Stream.ANGLES else block.forces).append((residuals, values))

    def close(self, stamp: int) -> list[Block]:
        """Blocks that nothing is waited for any more once a stroke has come with `stamp` (ns); they may be empty."""
        done = []
        while self._open and self._open[0].end + GRACE <= stamp:
            done.append(self._open.popleft())
            self._closed = done[-1].number
        return done

    def _at(self, stamp: int) -> Block | None:
        """The block of a stamp, with those in between opened; None if it is closed already."""
        number = stamp // BLOCK
        if number <= self._closed:
            return None
        if not self._open:
            self._open.append(Block(number))
        while self._open[-1].number < number:
            self._open.append(Block(self._open[-1].number + 1))
        while self._open[0].number > number:
            self._open.appendleft(Block(self._open[0].number - 1))
        return self._open[number - self._open[0].number]


def stacked(rows: list[tuple[Residuals, Array]], channels: int) -> tuple[Array, Array, Array]:
    """Stamps (k,) in s, measured and residual values (k, channels)."""
    if not rows:
        return np.zeros(0), np.zeros((0, channels)), np.zeros((0, channels))
    stamps = np.array([residuals.stamp for residuals, _ in rows]) * NANO
    return stamps, np.array([values for _, values in rows]), np.array([residuals.values for residuals, _ in rows])


def means(left: Array, sigma: float) -> tuple[Array, Array]:
    """Mean without outliers and number of values, by channel; NaN and 0 where there are none.

    Parameters
    ----------
    left : ndarray, shape (k, channels)
        Residuals; NaN where not measured.
    sigma : float
        Their noise: what is further than 6 of it from the median is an outlier.
    """
    if not len(left):
        return np.full(left.shape[1], np.nan), np.zeros(left.shape[1])
    if not np.isfinite(left.sum()):
        return _means_of_some(left, sigma)
    middle = np.sort(left, axis=0)[len(left) // 2]
    near = np.abs(left - middle) <= 6.0 * sigma
    if near.all():
        return left.mean(axis=0), np.full(left.shape[1], float(len(left)))
    return np.where(near, left, 0.0).sum(axis=0) / near.sum(axis=0), near.sum(axis=0).astype(float)


def _means_of_some(left: Array, sigma: float) -> tuple[Array, Array]:
    mean, count = np.full(left.shape[1], np.nan), np.zeros(left.shape[1])
    for i, column in enumerate(left.T):
        known = column[np.isfinite(column)]
        if len(known):
            near = known[np.abs(known - np.sort(known)[len(known) // 2]) <= 6.0 * sigma]
            mean[i], count[i] = near.mean(), len(near)
    return mean, count
