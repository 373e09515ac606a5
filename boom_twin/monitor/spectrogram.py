"""The density of the tip's acceleration against time, from the rows that are kept: so it is there when a page is opened."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..records import Array
from .spectrum import SEGMENT, spacing

STEP = 2.0
"""Seconds of session time from one column to the next; columns end at its multiples."""
FREQUENCIES = np.arange(0.0, 20.0 + 0.5 / SEGMENT, 1.0 / SEGMENT)
"""Hz, of every column."""
FULL = 0.9
"""Share of a segment that its rows must span."""


def spectrogram(times: Array, values: Array, ends: Array) -> NDArray[np.float32]:
    """One-sided densities, (m/s^2)^2/Hz, of the segments before `ends`.

    Each is a periodogram with Hann's window, both directions added; Welch's method averages such.

    Parameters
    ----------
    times, values : ndarray, shapes (n,) and (n, c)
        s, m/s^2.
    ends : ndarray, shape (k,)
        s.

    Returns
    -------
    ndarray, shape (k, len(FREQUENCIES))
        NaN where rows are missing, and above half the rate.
    """
    found = np.full((len(ends), len(FREQUENCIES)), np.nan, dtype=np.float32)
    finite = np.isfinite(values).all(axis=1)
    times, values = times[finite], values[finite]
    places = np.searchsorted(times, np.stack([ends - SEGMENT, ends]), side="right")
    for column, (first, stop) in enumerate(places.T):
        segment = times[first:stop]
        if len(segment) > 32 and segment[-1] - segment[0] > FULL * SEGMENT:
            density = _periodogram(segment, values[first:stop])[: len(FREQUENCIES)]
            found[column, : len(density)] = density
    return found


def _periodogram(times: Array, values: Array) -> Array:
    """Density at multiples of 1 / `SEGMENT`, Hz."""
    count = round(SEGMENT / spacing(times))
    even = times[-1] - SEGMENT + SEGMENT / count * np.arange(1, count + 1)
    window = np.hanning(count + 1)[:-1]
    rows = np.stack([np.interp(even, times, column) for column in values.T])
    power = np.abs(np.fft.rfft((rows - rows.mean(axis=1, keepdims=True)) * window)) ** 2
    return np.asarray(2.0 * SEGMENT / count * power.sum(axis=0) / np.sum(window**2))
