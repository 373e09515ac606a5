"""Blocks of 0.1 s of predictions and measured samples, in the order of time, from samples in any order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..types import Array, Stream

BLOCK = 100_000_000  # ns; a block waits as long for late samples


class PredictionRows(NamedTuple):
    """Predictions with the measured strokes that caused them.

    Attributes
    ----------
    stamps : ndarray of int64, shape (k,)
        ns.
    measured : ndarray, shape (k, n)
        Strokes, m.
    variances : ndarray, shape (k, n)
        Variances of the estimated strokes, m^2.
    """

    stamps: NDArray[np.int64]
    measured: Array
    variances: Array


class MeasuredRows(NamedTuple):
    """Measured samples of one stream.

    Attributes
    ----------
    stamps : ndarray of int64, shape (k,)
        ns.
    raw, left, sigmas : ndarray, shape (k, channels)
        Readings, residuals and expected standard deviations of these, in the unit of the sensor.
    """

    stamps: NDArray[np.int64]
    raw: Array
    left: Array
    sigmas: Array


Rows = TypeVar("Rows", PredictionRows, MeasuredRows)


class Block:
    """Predictions and samples within one block.

    Attributes
    ----------
    start, end : int
        Stamps (ns) at which it begins and ends.
    """

    def __init__(self, number: int) -> None:
        self.number, self.start, self.end = number, number * BLOCK, (number + 1) * BLOCK
        self.followed: list[PredictionRows] = []
        self.compared: dict[Stream, list[MeasuredRows]] = {}

    def predictions(self) -> PredictionRows:
        """Return all predictions; there is at least one."""
        return joined(self.followed)

    def readings(self, stream: Stream) -> MeasuredRows | None:
        """Return all samples of a stream; None without any."""
        rows = self.compared.get(stream)
        return None if rows is None else joined(rows)


def joined(parts: list[Rows]) -> Rows:
    """Return the rows of all parts, one after the other."""
    if len(parts) == 1:
        return parts[0]
    return type(parts[0])(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def by_block(rows: Rows) -> Iterator[tuple[int, Rows]]:
    """Yield the number of every block that has rows, and these."""
    numbers = rows.stamps // BLOCK
    if (first := int(numbers.min())) == numbers.max():
        yield first, rows
        return
    for number in sorted(set(numbers.tolist())):
        own = numbers == number
        yield number, type(rows)(*(column[own] for column in rows))


class BlockBuilder:
    """Open blocks, in the order of time."""

    def __init__(self) -> None:
        self._open: dict[int, Block] = {}  # by number, without a gap
        self._closed = -1

    def predicted(self, followed: PredictionRows) -> None:
        """Take predictions, at least one."""
        for number, rows in by_block(followed):
            if (block := self._at(number)) is not None:
                block.followed.append(rows)

    def measured(self, stream: Stream, compared: MeasuredRows) -> None:
        """Take samples of a stream with their residuals, at least one."""
        for number, rows in by_block(compared):
            if (block := self._at(number)) is not None:
                block.compared.setdefault(stream, []).append(rows)

    def close(self, stamp: int) -> list[Block]:
        """Return blocks for which no sample is awaited once a stroke has come with `stamp` (ns); they may be empty."""
        done = [self._open.pop(number) for number in sorted(self._open) if (number + 2) * BLOCK <= stamp]
        self._closed = done[-1].number if done else self._closed
        return done

    def _at(self, number: int) -> Block | None:
        """Return the block of a number, and open those in between; None if it is closed already."""
        if number <= self._closed:
            return None
        if number not in self._open:
            known = number, *self._open
            self._open = {each: self._open.get(each) or Block(each) for each in range(min(known), max(known) + 1)}
        return self._open[number]
