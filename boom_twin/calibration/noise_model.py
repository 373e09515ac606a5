"""Samples averaged over blocks of time, measured and predicted ones alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..records import Array, Mount, Stream, channels_of
from .course import Course, filled
from .measured import NANO, Measured, Series

SHORTEST = 0.05  # s
END = 0.25  # s before the end of a course that are not used, for smoothing ends there
LEAST = 0.5  # of the values of a block that must be there
STREAMS = (Stream.ANGLES, Stream.IMU)


@dataclass(frozen=True)
class Blocks:
    """Measured means of b blocks in c channels, and how predictions on a grid of m instants are averaged likewise.

    Attributes
    ----------
    times : ndarray, shape (b,)
        Middles, s after the start of the course.
    measured : ndarray, shape (b, c)
        NaN where too little was measured.
    counts : ndarray, shape (b, c)
        How many samples are in each.
    means : tuple of sparse array, shape (b, m)
        For the angles, and for the IMU if there is one.
    """

    times: Array
    measured: Array
    counts: Array
    means: tuple[csr_array, ...]

    def averaged(self, angles: Array, force: Array) -> Array:
        """Means of predicted joint angles (m, n) and specific force (m, 2), shape (b, c)."""
        parts = [mean @ values for mean, values in zip(self.means, (angles, force), strict=False)]
        return np.concatenate(parts, axis=1)


def has_imu(sessions: Sequence[Measured]) -> bool:
    """Whether every session has a tip IMU; if one lacks it, it is left out of all."""
    return all(Stream.IMU in session.series for session in sessions)


def block_length(sessions: Sequence[Measured], imu: bool) -> float:
    """Time (s) that holds samples of every stream of every session."""
    intervals = [np.median(np.diff(session.series[stream].stamps)) * NANO for session in sessions for stream in used(imu)]
    return max(SHORTEST, 2.0 * float(max(intervals)))


def used(imu: bool) -> tuple[Stream, ...]:
    """The streams that are compared."""
    return STREAMS if imu else STREAMS[:1]


def channel_names(joints: int, imu: bool) -> tuple[str, ...]:
    """Of the columns."""
    known = channels_of(joints)
    return tuple(name for stream in used(imu) for name in known[stream])


def blocks_of(session: Measured, course: Course, length: float, imu: bool, mounts: Sequence[Mount | None]) -> Blocks:
    """Average a session over blocks of `length` (s); the angles of inclinometers are left out."""
    count = int((course.duration - END) / length)
    measured, counts, means = [], [], []
    for stream in used(imu):
        series = session.series[stream].of(course.start, course.start + round((count * length) / NANO))
        values = series.values.copy()
        if stream is Stream.ANGLES:
            values[:, [mount is not None for mount in mounts]] = np.nan
        found, number, mean = _averages(Series(series.stamps, values), course, length, count)
        measured.append(found)
        counts.append(number)
        means.append(mean)
    times: Array = np.asarray(length * (0.5 + np.arange(count)))
    return Blocks(times, np.concatenate(measured, axis=1), np.concatenate(counts, axis=1), tuple(means))


def _averages(series: Series, course: Course, length: float, count: int) -> tuple[Array, Array, csr_array]:
    """Means (count, channels), numbers of values in them, and the average of linear interpolations on the course's grid."""
    times: Array = np.asarray((series.stamps - course.start) * NANO)
    block = np.minimum((times / length).astype(np.int64), count - 1)
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
