"""Size and main frequency of the estimated load at the tip: a windowed periodogram with an interpolated peak.

The load is averaged in bins of `BIN`, then looked at in windows of `WINDOW`. Hann's window, padded with zeros; the largest
peak that stands out from its neighbourhood by `STANDS_OUT` is the main frequency, a parabola through the logarithms gives its
place. With r the power of the peak over that of the neighbourhood and T the length of the window, the standard deviations are

    frequency  0.487 / (T sqrt(r))          amplitude  a share of 1 / sqrt(2 r)

of a sinusoid in noise that is white nearby (the Cramer-Rao bound of Rife and Boorstyn, IEEE Trans. Inf. Theory 20, 1974,
times 1.53 for the window). The height of pulses is that of rectangular ones, on for half of every period, with this
fundamental: pi / 2 times its amplitude.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Array
from .sample_series import BREAK

BIN = 0.05  # s
WINDOW = 80.0  # s
SHORTEST = 10.0  # s of load, below which no frequency is looked for
LEAST = 20.0  # N; a smaller load is none
LOWEST, HIGHEST = 4.0, 3.0  # cycles in a window; Hz
STANDS_OUT = 25.0  # power of a peak over that of its neighbourhood
LOBE = 4  # unpadded lines to each side that belong to a peak
PADDED = 8  # times as long with zeros


@dataclass(frozen=True, slots=True)
class Pulses:
    """Periodic part of a load.

    Attributes
    ----------
    height, height_sigma : float
        Of rectangular pulses, on for half of every period, with the same fundamental, and its standard deviation, N. In
        `TipLoad` that contains the standard deviation of the estimated load, since its error may have the same frequency.
    frequency, frequency_sigma : float
        Hz.
    """

    height: float
    height_sigma: float
    frequency: float
    frequency_sigma: float


@dataclass(frozen=True, slots=True)
class TipLoad:
    """Load at the tip that the model does not know.

    Attributes
    ----------
    rms, sigma : float
        Root mean squares of the estimate and of its standard deviation, N.
    pulses : Pulses or None
        Periodic part, if it stands out, is `LEAST` or more, and can be told from none.
    """

    rms: float
    sigma: float
    pulses: Pulses | None

    @property
    def bound(self) -> float:
        """Upper bound of the load, N: its estimate and two standard deviations of that."""
        return max(LEAST, self.rms + 2.0 * self.sigma)

    @property
    def is_there(self) -> bool:
        """Return True if the load can be told from none, or has pulses."""
        return self.rms >= max(LEAST, 2.0 * self.sigma) or self.pulses is not None

    @property
    def text(self) -> str:
        """Load in words: ``pulses of 128 N (+- 14) at 0.430 Hz (+- 0.001)``, or its size, or an upper bound.

        A load that is there from the start looks like a change of drives, so that the bound does not hold for it.
        """
        if self.pulses is not None:
            digits = min(max(1, int(np.ceil(-np.log10(self.pulses.frequency_sigma)))), 4)
            sure = f"{self.pulses.frequency:.{digits}f} Hz (+- {self.pulses.frequency_sigma:.{digits}f})"
            return f"pulses of {self.pulses.height:.0f} N (+- {self.pulses.height_sigma:.0f}) at {sure}"
        if self.is_there:
            return f"{self.rms:.0f} N rms (+- {self.sigma:.0f}), no main frequency"
        return f"none above {self.bound:.0f} N after the start"


def find_pulses(load: Array, interval: float) -> Pulses | None:
    """Return the strongest periodic part that stands out; None if there is none.

    Parameters
    ----------
    load : ndarray, shape (k, 2)
        N, every `interval` (s).
    """
    span = len(load) * interval
    if span < SHORTEST:
        return None
    window = np.hanning(len(load) + 1)[:-1]
    centred = window[:, None] * (load - window @ load / window.sum())
    lines = np.fft.rfft(centred, PADDED * len(load), axis=0)
    frequencies = np.arange(float(len(lines))) / (PADDED * span)
    peak = _highest(frequencies, np.square(np.abs(lines)).sum(axis=1), span)
    if peak is None:
        return None
    power = np.square(np.abs(lines @ _direction(lines[peak])))
    peak = peak - 1 + int(np.argmax(power[peak - 1 : peak + 2]))
    ratio = float(_prominences(frequencies, power, np.array([peak]), span)[0])
    if ratio < STANDS_OUT:
        return None
    offset, top = _vertex(np.log(power[peak - 1 : peak + 2]))
    height = 0.5 * pi * 2.0 * sqrt(float(np.exp(top))) / float(window.sum())
    frequency = float(frequencies[peak] + offset * frequencies[1])
    return Pulses(height, height / sqrt(2.0 * ratio), frequency, 0.487 / (span * sqrt(ratio)))


def _highest(frequencies: Array, power: Array, span: float) -> int | None:
    """Return the place of the highest peak that stands out; None if there is none."""
    inner = np.arange(1, len(power) - 1)
    is_peak = (power[inner] > power[inner - 1]) & (power[inner] >= power[inner + 1]) & (power[inner] > 0.0)
    is_inside = (frequencies[inner] >= LOWEST / span) & (frequencies[inner] <= HIGHEST)
    found = inner[is_peak & is_inside]
    found = found[_prominences(frequencies, power, found, span) >= STANDS_OUT]
    return int(found[np.argmax(power[found])]) if len(found) else None


def _prominences(frequencies: Array, power: Array, places: NDArray[np.int64], span: float) -> Array:
    """Return the power of peaks (k,) over the mean power on the higher side, from half the frequency to twice."""
    at, lobe, sums = frequencies[places], LOBE / span, np.concatenate([[0.0], np.cumsum(power)])
    sides = (0.5 * at, at - lobe), (at + lobe, np.maximum(2.0 * at - lobe, at + 3.0 * lobe))
    level = np.zeros(len(places))
    for above, below in sides:
        first, end = np.searchsorted(frequencies, above, "right"), np.searchsorted(frequencies, below, "left")
        count = np.maximum(end - first, 0)
        level = np.maximum(level, (sums[first + count] - sums[first]) / np.maximum(count, 1))
    return np.asarray(np.divide(power[places], level, out=np.full(len(places), np.inf), where=level > 0.0))


def _direction(lines: NDArray[np.complex128]) -> Array:
    """Return the unit vector (2,) along which a complex amplitude (2,) is largest."""
    _, vectors = np.linalg.eigh(np.real(np.outer(lines, lines.conj())))
    return np.asarray(vectors[:, -1])


def _vertex(levels: Array) -> tuple[float, float]:
    """Return place and height of the vertex of the parabola through three `levels`.

    The place is from -0.5 to 0.5 about the middle one.
    """
    below, top, above = levels
    bend = below - 2.0 * top + above
    offset = 0.5 * (below - above) / bend if bend else 0.0
    return float(offset), float(top - 0.25 * (below - above) * offset)


class TipLoadFinder:
    """Finder of the load in estimates that come in parts; its memory does not grow with their number.

    The same estimates give the same load, in whatever parts they come.
    """

    def __init__(self) -> None:
        self._squares, self._variances, self._count = 0.0, 0.0, 0
        self._strongest: Pulses | None = None
        self._first: int | None = None  # stamp with which the window begins, ns
        self._newest = 0
        self._places: NDArray[np.int64] = np.zeros(0, np.int64)  # bin of every load that is kept
        self._loads: Array = np.zeros((0, 2))

    def add(self, stamps: NDArray[np.int64], loads: Array, variances: Array) -> None:
        """Add loads (k, 2) in N and their variances (k, 2) at `stamps` (k,) in ns.

        Loads of exactly zero, from before any measurement, are skipped.
        """
        known = loads.any(axis=1)
        stamps, loads = stamps[known], loads[known]
        self._variances += float(variances[known].sum())
        self._squares += float(np.square(loads).sum())
        self._count += len(loads)
        steps = np.diff(stamps, prepend=self._newest) * NANO
        cuts = np.flatnonzero((steps < 0.0) | (steps > BREAK))
        for first, last in zip([0, *cuts], [*cuts, len(stamps)], strict=True):
            if first in cuts:
                self._close()
            self._append(stamps[first:last], loads[first:last])

    def _append(self, stamps: NDArray[np.int64], loads: Array) -> None:
        """Append consecutive loads."""
        if not len(stamps):
            return
        self._newest = int(stamps[-1])
        self._first = int(stamps[0]) if self._first is None else self._first
        self._places = np.concatenate([self._places, ((stamps - self._first) * NANO // BIN).astype(np.int64)])
        self._loads = np.concatenate([self._loads, loads])
        while len(self._places) and self._places[-1] >= (most := round(WINDOW / BIN)):
            whole = int(np.searchsorted(self._places, most))
            self._strongest = _stronger(self._strongest, _pulses_in_bins(self._places[:whole], self._loads[:whole]))
            self._places, self._loads = self._places[whole:] - most, self._loads[whole:]
            self._first += round(WINDOW / NANO)

    def _close(self) -> None:
        """Close the window."""
        self._strongest = _stronger(self._strongest, _pulses_in_bins(self._places, self._loads))
        self._first, self._places, self._loads = None, self._places[:0], self._loads[:0]

    @property
    def load(self) -> TipLoad | None:
        """Load of all estimates so far; None if there are none.

        Its pulses are those of the window where they are highest.
        """
        if not self._count:
            return None
        newest = _pulses_in_bins(self._places, self._loads)
        rms, sigma = sqrt(self._squares / self._count), sqrt(self._variances / self._count)
        pulses = _stronger(self._strongest, newest)
        if pulses is not None:
            pulses = replace(pulses, height_sigma=hypot(pulses.height_sigma, sigma))
            pulses = pulses if pulses.height >= max(LEAST, 2.0 * pulses.height_sigma) else None
        return TipLoad(rms, sigma, pulses)


def _stronger(one: Pulses | None, other: Pulses | None) -> Pulses | None:
    return max((each for each in (one, other) if each is not None), key=lambda each: each.height, default=None)


def _pulses_in_bins(places: NDArray[np.int64], loads: Array) -> Pulses | None:
    """Return the pulses in loads (k, 2) with ascending bin numbers (k,); empty bins are bridged."""
    if not len(places):
        return None
    bins, starts, counts = np.unique(places, return_index=True, return_counts=True)
    means = np.add.reduceat(loads, starts, axis=0) / counts[:, None]
    every = np.arange(bins[0], bins[-1] + 1)
    return find_pulses(np.stack([np.interp(every, bins, column) for column in means.T], axis=1), BIN)
