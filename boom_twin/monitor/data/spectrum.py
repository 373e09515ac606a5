"""Spectrum and spectrogram of the tip's acceleration: density, peaks with frequency and damping."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan, pi

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, hilbert, periodogram

from ...analysis.sample_series import power_density, spacing
from ...types import Array

SPECTRUM_SPAN = 40.0  # time span of the spectrum, up to the shown time, s
SEGMENT = 8.0  # segment of Welch's method, s (Hann window, half overlapping, mean removed)
LOWEST_PEAK, HIGHEST_PEAK = 0.3, 30.0  # frequencies of peaks, Hz
MAX_PEAKS = 5
PROMINENCE = 6.0  # lowest prominence of a peak, dB
BAND = 0.3  # half width of the band around a peak for its damping, as a share of its frequency
DECAY_FLOOR = 0.3  # lowest evaluated value of a decay, as a share of its first


@dataclass(frozen=True, slots=True)
class Peak:
    """Peak of the spectrum: frequency (Hz), damping ratio (NaN if not known), density ((m/s^2)^2/Hz)."""

    frequency: float
    damping: float
    density: float


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Spectrum: frequencies (k,) in Hz, one-sided densities (k, c) in (m/s^2)^2/Hz, peaks of their sum by frequency."""

    frequencies: Array
    densities: Array
    peaks: tuple[Peak, ...]


def spectrum(times: Array, values: Array) -> Spectrum | None:
    """Return the spectrum of `values` (n, c) in m/s^2 at `times` (n,) in s; None if they last less than one segment."""
    finite = np.isfinite(values).all(axis=1)
    times, values = times[finite], values[finite]
    if len(times) < 32 or times[-1] - times[0] < SEGMENT:
        return None
    rate = 1.0 / spacing(times)
    even = times[0] + np.arange(round((times[-1] - times[0]) * rate) + 1) / rate
    values = np.stack([np.interp(even, times, column) for column in values.T], axis=1)
    length = min(round(SEGMENT * rate), len(even))
    frequencies, densities, _ = power_density(values, 1.0 / rate, length)
    peaks = tuple(sorted(_peaks(frequencies, densities.sum(axis=1), values, rate), key=lambda peak: peak.frequency))
    return Spectrum(frequencies, densities, peaks)


def _peaks(frequencies: Array, density: Array, values: Array, rate: float) -> list[Peak]:
    """Return the highest prominent peaks. Their frequency is from a parabola through the decibels."""
    level = 10.0 * np.log10(np.maximum(density, 1e-30))
    found, _ = find_peaks(level, prominence=PROMINENCE)
    found = [i for i in found if LOWEST_PEAK <= frequencies[i] <= min(HIGHEST_PEAK, 0.4 * rate)]
    peaks = []
    for i in sorted(found, key=lambda place: -level[place])[:MAX_PEAKS]:
        below, top, above = level[i - 1 : i + 2]
        bend = below - 2.0 * top + above
        offset = 0.5 * (below - above) / bend if bend else 0.0
        frequency = float(frequencies[i] + offset * (frequencies[1] - frequencies[0]))
        peaks.append(Peak(frequency, damping(values, rate, frequency), float(density[i])))
    return peaks


def damping(values: Array, rate: float, frequency: float) -> float:
    """Return the damping ratio of the mode at `frequency` (Hz), from the autocorrelation's decay in the band around it.

    The autocorrelation of a lightly damped mode under random excitation decays as its free vibration does, as
    exp(-2 pi zeta f t) (Cole 1973). NaN if it does not decay. `values` (n, c) are at `rate` (Hz).
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
    low = np.flatnonzero(envelope[start:stop] < DECAY_FLOOR * envelope[start])
    stop = start + int(low[0]) if len(low) else stop
    if stop - start < rate / frequency:
        return nan
    slope = np.polyfit(np.arange(start, stop) / rate, np.log(envelope[start:stop]), 1)[0]
    ratio = float(-slope / (2.0 * pi * frequency))
    return ratio if isfinite(ratio) and ratio > 0.0 else nan


COLUMN_STEP = 2.0  # session time between columns of the spectrogram, s; columns end at its multiples
FREQUENCIES = np.arange(0.0, 20.0 + 0.5 / SEGMENT, 1.0 / SEGMENT)  # frequencies of every column, Hz
COVERAGE = 0.9  # smallest share of a segment that its rows span


def spectrogram(times: Array, values: Array, ends: Array) -> NDArray[np.float32]:
    """Return one-sided densities, (m/s^2)^2/Hz, of the segments before `ends`.

    Each is a periodogram with Hann window, summed over the directions; Welch's method averages these. `values` (n, c) in m/s^2
    are at `times` (n,) in s, `ends` (k,) are in s. A row has the densities at `FREQUENCIES`. It is NaN without data, and above
    half the rate.
    """
    found = np.full((len(ends), len(FREQUENCIES)), np.nan, dtype=np.float32)
    finite = np.isfinite(values).all(axis=1)
    times, values = times[finite], values[finite]
    places = np.searchsorted(times, np.stack([ends - SEGMENT, ends]), side="right")
    for column, (first, stop) in enumerate(places.T):
        segment = times[first:stop]
        if len(segment) > 32 and segment[-1] - segment[0] > COVERAGE * SEGMENT:
            density = _periodogram(segment, values[first:stop])[: len(FREQUENCIES)]
            found[column, : len(density)] = density
    return found


def _periodogram(times: Array, values: Array) -> Array:
    """Return the density at multiples of 1 / `SEGMENT`, Hz."""
    count = round(SEGMENT / spacing(times))
    even = times[-1] - SEGMENT + SEGMENT / count * np.arange(1, count + 1)
    rows = np.stack([np.interp(even, times, column) for column in values.T])
    return np.asarray(periodogram(rows, count / SEGMENT, "hann")[1].sum(axis=0))
