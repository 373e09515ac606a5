"""Noise model of a calibration: block averages, and a vector autoregression that whitens residuals.

The noise of block means is not white: the sensors' own is, but noise of the strokes shakes the boom's natural modes, which
ring for seconds and move all channels together. Its realisations, made by the very model, are fitted by

    e_t = sum_k A_k e_(t-k) + L w_t,    k = 1 .. p,

with w of unit variance and white (Luetkepohl, New Introduction to Multiple Time Series Analysis, 2005, ch. 3, least squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..types import NANO, Array, Mount, Stream, channels_of
from .sessions import MeasuredSession, Series, SessionCourse, filled

SHORTEST = 0.05  # s
END = 0.25  # s before the end of a course that are not used, for smoothing ends there
USUAL = 1.5  # times the median: longer times between samples are gaps
LEAST = 0.5  # of the values of a block that must be there


@dataclass(frozen=True)
class ResidualBlocks:
    """Measured means of b blocks in c channels, and the averaging matrices of predictions on a grid of m instants.

    Attributes
    ----------
    times : ndarray, shape (b,)
        Middles, s after the start of the course.
    measured : ndarray, shape (b, c)
        NaN where too little was measured.
    counts : ndarray, shape (b, c)
        How many samples are in each.
    means : dict of Stream to sparse array, shape (b, m)
    """

    times: Array
    measured: Array
    counts: Array
    means: dict[Stream, csr_array]

    def averaged(self, readings: Mapping[Stream, Array]) -> Array:
        """Return the means of predicted readings (k, m, channels) of every stream, shape (k, b, c)."""
        count = len(next(iter(readings.values())))
        rows = [[mean @ readings[stream][k] for stream, mean in self.means.items()] for k in range(count)]
        return np.array([np.concatenate(parts, axis=1) for parts in rows])


def block_length(
    sessions: Sequence[MeasuredSession], streams: Sequence[Stream], shortest: float = SHORTEST, least: float = 2.0
) -> float:
    """Return the time (s) in which every stream of every session has `least` samples on average; `shortest` or more."""
    gaps = [np.diff(session.series[stream].stamps) * NANO for session in sessions for stream in streams]
    return max(shortest, least * max(float(each[each < USUAL * np.median(each)].mean()) for each in gaps))


def channel_names(joints: int, streams: Sequence[Stream]) -> tuple[str, ...]:
    """Return the names of the channels of the streams, in the order of `ResidualBlocks`."""
    known = channels_of(joints)
    return tuple(name for stream in streams for name in known[stream])


def blocks_of(
    session: MeasuredSession,
    course: SessionCourse,
    length: float,
    streams: Sequence[Stream],
    mounts: Sequence[Mount | None],
    lead: float = 0.0,
) -> ResidualBlocks:
    """Average a session over blocks of `length` (s), the first of which begins `lead` (s) before the course.

    The angles of inclinometers are left out.
    """
    count = int((course.duration - END) / length)
    measured, counts, means = [], [], {}
    for stream in streams:
        series = session.series[stream].of(course.start, course.start + round((count * length) / NANO))
        values = series.values.copy()
        if stream is Stream.ANGLES:
            values[:, [mount is not None for mount in mounts]] = np.nan
        found, number, mean = _averages(Series(series.stamps, values), course, length, count, lead)
        measured.append(found)
        counts.append(number)
        means[stream] = mean
    times: Array = np.asarray(length * (0.5 + np.arange(count)) - lead)
    return ResidualBlocks(times, np.concatenate(measured, axis=1), np.concatenate(counts, axis=1), means)


def _averages(series: Series, course: SessionCourse, length: float, count: int, lead: float) -> tuple[Array, Array, csr_array]:
    """Return block means (count, channels), numbers of values in them, and the averaging matrix of predictions.

    The matrix averages linear interpolations on the course's grid.
    """
    times: Array = np.asarray((series.stamps - course.start) * NANO)
    block = np.minimum(((times + lead) / length).astype(np.int64), count - 1)
    there = np.isfinite(series.values)
    total = np.bincount(block, minlength=count)
    mean = csr_array((1.0 / total[block], (block, np.arange(len(block)))), shape=(count, len(block)))
    shares = mean @ there.astype(float)
    means = np.where(shares > LEAST, mean @ filled(times, series.values), np.nan)
    return means, shares * total[:, None], _interpolated_mean(times / course.step, block, total, len(course.strokes))


def _interpolated_mean(places: Array, block: NDArray[np.int64], total: NDArray[np.int64], grid: int) -> csr_array:
    left = np.minimum(places.astype(np.int64), grid - 2)
    share, weight = places - left, 1.0 / total[block]
    rows, columns = np.tile(block, 2), np.concatenate([left, left + 1])
    return csr_array((np.concatenate([(1.0 - share) * weight, share * weight]), (rows, columns)), shape=(len(total), grid))


MEMORY = 2.0  # s, in which a boom's slowest swing is told from others near it


@dataclass(frozen=True)
class NoiseModel:
    """Whitening filter for c channels: `matrix` (c, c) is the inverse of L, `past` (p, c, c) holds A_1 .. A_p."""

    matrix: Array
    past: Array

    def __call__(self, residuals: Array) -> Array:
        """Return the white residuals of b consecutive blocks, shape (.., b, c) to (.., b - p, c).

        They are 0 where a value they need is missing.
        """
        order, count = len(self.past), residuals.shape[-2]
        left = residuals[..., order:, :].copy()
        for k, gain in enumerate(self.past, start=1):
            left -= residuals[..., order - k : count - k, :] @ gain.T
        return np.asarray(np.nan_to_num(left @ self.matrix.T, nan=0.0))

    def of_constant(self, values: Array) -> Array:
        """Return the white residuals that a constant (.., c) has in every block."""
        return np.asarray((values - values @ self.past.sum(axis=0).T) @ self.matrix.T)


def whitening_of(noise: Sequence[Array], length: float) -> NoiseModel:
    """Fit the filter to realisations, each of shape (k, b, c), of blocks of `length` (s)."""
    order = max(1, round(MEMORY / length))
    past = np.concatenate([_lagged(each, order) for each in noise])
    now = np.concatenate([each[:, order:].reshape(-1, each.shape[-1]) for each in noise])
    gains = np.linalg.solve(past.T @ past, past.T @ now)
    left = now - past @ gains
    channels = now.shape[1]
    factor = np.linalg.cholesky(left.T @ left / len(left))
    return NoiseModel(np.linalg.inv(factor), gains.T.reshape(channels, order, channels).swapaxes(0, 1))


def _lagged(noise: Array, order: int) -> Array:
    """Return the values before every one, newest first, shape (k (b - p), p c)."""
    count = noise.shape[1]
    columns = [noise[:, order - k : count - k] for k in range(1, order + 1)]
    return np.concatenate(columns, axis=2).reshape(-1, order * noise.shape[2])
