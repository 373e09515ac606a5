"""Spectrum of the tip's acceleration: its density, and peaks with frequency and damping."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan, pi

import numpy as np
from scipy.signal import find_peaks, hilbert, welch

from ..records import Array

WINDOW = 40.0
"""Seconds that are looked at."""
SEGMENT = 8.0
"""Seconds of one segment of Welch's method (Hann window, half overlapping, mean removed)."""
HIGHEST = 30.0
"""Hz; no peak above it."""
LOWEST = 0.3
MOST = 5
PROMINENCE = 6.0
"""dB by which a peak stands out."""
BAND = 0.3
"""Half width of the band around a peak whose decay gives the damping, as a share of its frequency."""
FALL = 0.3
"""Share of its start down to which a decay is looked at."""


MOST_POINTS = 40_000
"""Evenly spaced points that rows are brought to at most: a millisecond apart in a `WINDOW`."""


@dataclass(frozen=True, slots=True)
class Peak:
    """A peak of the spectrum: frequency (Hz), damping ratio (NaN if not to be had), density ((m/s^2)^2/Hz)."""

    frequency: float
    damping: float
    density: float


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Frequencies (k,) in Hz, one-sided densities (k, c) in (m/s^2)^2/Hz, peaks of their sum by frequency."""

    frequencies: Array
    densities: Array
    peaks: tuple[Peak, ...]


def spectrum(times: Array, values: Array) -> Spectrum | None:
    """Of `values` (n, c) in m/s^2 at `times` (n,) in s; None where they last less than one segment."""
    finite = np.isfinite(values).all(axis=1)
    times, values = times[finite], values[finite]
    if len(times) < 32 or times[-1] - times[0] < SEGMENT:
        return None
    rate = 1.0 / spacing(times)
    even = times[0] + np.arange(round((times[-1] - times[0]) * rate) + 1) / rate
    values = np.stack([np.interp(even, times, column) for column in values.T], axis=1)
    length = min(round(SEGMENT * rate), len(even))
    frequencies, densities = welch(values, rate, "hann", length, detrend="constant", axis=0)
    peaks = tuple(sorted(_peaks(frequencies, densities.sum(axis=1), values, rate), key=lambda peak: peak.frequency))
    return Spectrum(frequencies, densities, peaks)


def spacing(times: Array) -> float:
    """Usual distance (s) of `times` (n,), at least so much that there are `MOST_POINTS` in all of their span."""
    return max(float(np.median(np.diff(times))), float(times[-1] - times[0]) / MOST_POINTS)


def _peaks(frequencies: Array, density: Array, values: Array, rate: float) -> list[Peak]:
    """The highest peaks that stand out, their frequencies by a parabola through the decibels."""
    level = 10.0 * np.log10(np.maximum(density, 1e-30))
    found, _ = find_peaks(level, prominence=PROMINENCE)
    found = [i for i in found if LOWEST <= frequencies[i] <= min(HIGHEST, 0.4 * rate)]
    peaks = []
    for i in sorted(found, key=lambda place: -level[place])[:MOST]:
        below, top, above = level[i - 1 : i + 2]
        bend = below - 2.0 * top + above
        offset = 0.5 * (below - above) / bend if bend else 0.0
        frequency = float(frequencies[i] + offset * (frequencies[1] - frequencies[0]))
        peaks.append(Peak(frequency, damping(values, rate, frequency), float(density[i])))
    return peaks


def damping(values: Array, rate: float, frequency: float) -> float:
    """Damping ratio of the mode at `frequency` (Hz) from the decay of the autocorrelation in the band around it.

    The autocorrelation of a lightly damped mode that is shaken at random decays as its free vibration does, as
    exp(-2 pi zeta f t) (Cole 1973). NaN where it does not decay.

    Parameters
    ----------
    values : ndarray, shape (n, c)
        At `rate` (Hz).
    """
    count = len(values)
    power = np.square(np.abs(np.fft.rfft(values - values.mean(axis=0), 2 * count, axis=0))).sum(axis=1)
    offsets = (np.fft.rfftfreq(2 * count, 1.0 / rate) - frequency) / (BAND * frequency)
    power *= np.where(np.abs(offsets) < 1.0, np.cos(0.5 * pi * np.clip(offsets, -1.0, 1.0)) ** 2, 0.0)
    correlation = np.fft.irfft(power)[:count] / np.arange(count, 0, -1)
    envelope = np.abs(hilbert(correlation))
    start = round(rate / frequency)
    if not envelope[start] > 0.0:
        return nan
    stop = min(start + round(12.0 * rate / frequency), count // 2)
    low = np.flatnonzero(envelope[start:stop] < FALL * envelope[start])
    stop = start + int(low[0]) if len(low) else stop
    if stop - start < rate / frequency:
        return nan
    slope = np.polyfit(np.arange(start, stop) / rate, np.log(envelope[start:stop]), 1)[0]
    ratio = float(-slope / (2.0 * pi * frequency))
    return ratio if isfinite(ratio) and ratio > 0.0 else nan
