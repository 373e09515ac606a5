"""Readings of a session by name, and their means in the blocks that a commissioning check compares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..types import SENSORS, Array, Mount, Stream

BLOCK = 100_000_000  # ns, averaging time of readings
MEAN = 10  # blocks on each side in the mean of forces and accelerations, which removes vibration
CORRELATED = 5.0  # blocks with correlated vibration
EVENLY = 12  # compared blocks evenly in time, besides the extremes of every stroke


class Channel(NamedTuple):
    """Way to read a channel: quantity = sign * scale * (reading - zero), in `unit`. `turned` is an IMU's rotation, rad."""

    name: str
    unit: str
    sign: int = 1
    zero: float = 0.0
    scale: float = 1.0
    absolute: Mount | None = None
    turned: float = 0.0


def is_checked(stream: Stream) -> bool:
    """Return True if a commissioning check covers the stream."""
    return stream in (Stream.STROKES, Stream.ANGLES, Stream.FORCES) or SENSORS[stream].is_accelerometer


class Series(NamedTuple):
    """Readings of one name: stamps (k,) in ns, values (k,) in the unit of its messages."""

    stamps: NDArray[np.int64]
    values: Array


Window = Mapping[Stream, Mapping[str, Series]]
"""Readings of every stream by name."""


class Table(NamedTuple):
    """Readings of one stream in the blocks that are compared."""

    names: tuple[str, ...]
    values: Array  # (blocks, names), means, NaN without readings
    spreads: Array  # their standard errors by vibration


def tables_of(window: Window) -> dict[Stream, Table]:
    """Return the readings in selected blocks with all strokes, or empty tables without such a block.

    Names without readings there are left out.
    """
    strokes = [_means(series) for series in window[Stream.STROKES].values()]
    common = strokes[0][0] if strokes else np.zeros(0, np.int64)
    for numbers, _ in strokes[1:]:
        common = np.intersect1d(common, numbers)
    chosen = _chosen(common, [means[np.searchsorted(numbers, common)] for numbers, means in strokes])
    found = {}
    for stream, by_name in window.items():
        reach = MEAN if stream is Stream.FORCES or SENSORS[stream].is_accelerometer else 0
        columns = [_at(chosen, *_means(series), reach) for series in by_name.values()]
        values, spreads = np.moveaxis(np.array(columns).reshape(len(columns), 2, len(chosen)), 0, 2)
        there = np.flatnonzero(np.isfinite(values).any(axis=0))
        names = list(by_name)
        found[stream] = Table(tuple(names[i] for i in there.tolist()), values[:, there], spreads[:, there])
    return found


def _means(series: Series) -> tuple[NDArray[np.int64], Array]:
    is_read = np.isfinite(series.values)
    numbers, places, counts = np.unique(series.stamps[is_read] // BLOCK, return_inverse=True, return_counts=True)
    return numbers, np.bincount(places, series.values[is_read], len(numbers)) / np.maximum(counts, 1)


def _chosen(common: NDArray[np.int64], strokes: list[Array]) -> NDArray[np.int64]:
    if not len(common):
        return common
    rows = set(np.linspace(0, len(common) - 1, EVENLY).round().astype(int).tolist())
    rows |= {int(pick(values)) for values in strokes for pick in (np.argmin, np.argmax)}
    return common[sorted(rows)]


def _at(chosen: NDArray[np.int64], numbers: NDArray[np.int64], means: Array, reach: int) -> Array:
    """Return mean and standard error (2, blocks) over `reach` blocks before and after each chosen block."""
    first, end = np.searchsorted(numbers, chosen - reach), np.searchsorted(numbers, chosen + reach, "right")
    middle = means.mean() if len(means) else 0.0
    sums = [np.concatenate([[0.0], np.cumsum(each)]) for each in (means - middle, (means - middle) ** 2)]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean, square = ((each[end] - each[first]) / (end - first) for each in sums)
    share = np.minimum(CORRELATED / np.maximum(end - first, 1), 1.0)
    return np.array([mean + middle, np.sqrt(np.maximum(square - mean**2, 0.0) * share)])
