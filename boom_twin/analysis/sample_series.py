"""Series of samples: breaks and spacing of their times, power spectral density, running statistics of columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..types import Array

BREAK = 1.0  # step of time, s, that is not bridged; neither is a step back
SEGMENT = 8.0  # of Welch's method, s; lines of a spectrum are 1/SEGMENT apart


def unbroken(times: Array) -> list[slice]:
    """Return the parts of `times` (n,) in s that have no break; the memory of even times goes by samples in each."""
    steps = np.diff(times)
    cuts = (np.flatnonzero((steps < 0.0) | (steps > BREAK)) + 1).tolist()
    return [slice(first, stop) for first, stop in zip([0, *cuts], [*cuts, len(times)], strict=True)]


def spacing(times: Array) -> float:
    """Return the usual distance of ascending `times` (n,) in s: their median, at least half the mean."""
    return max(float(np.median(np.diff(times))), 0.5 * float(times[-1] - times[0]) / (len(times) - 1))


def power_density(values: Array, interval: float, segment: int) -> tuple[Array, Array, int]:
    """Return frequencies (lines,), one-sided power spectral density (lines,) or (lines, c) per Hz, and number of segments.

    Welch's method: Hann window, half overlap, means removed, `segment` values a segment of `values` (k,) or (k, c) at even
    times, `interval` s apart. ``scipy.signal.welch`` gives the same, but takes half a second to import.
    """
    parts = np.lib.stride_tricks.sliding_window_view(values, segment, axis=0)[:: segment - segment // 2]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(segment) / segment)
    lines = np.fft.rfft(window * (parts - parts.mean(axis=-1, keepdims=True)), axis=-1)
    power = 2.0 * interval * np.square(np.abs(lines)).mean(axis=0) / np.square(window).sum()
    power[..., 0] *= 0.5
    if segment % 2 == 0:
        power[..., -1] *= 0.5  # these two lines have no twin at a negative frequency
    return np.asarray(np.fft.rfftfreq(segment, interval)), np.asarray(power.T), len(parts)


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
