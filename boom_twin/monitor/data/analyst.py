"""Analysis of the shown data, in threads: spectrum, natural frequencies of the model."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.signal import find_peaks

from ...analysis.posture_modes import MOVED, ModeList, nearest_mode
from ...analysis.sample_series import SEGMENT, power_density, spacing
from ...types import Array
from ..protocol import SPECTRUM, pack
from .feed import Feed
from .topic_rows import ESTIMATE


@dataclass(frozen=True, slots=True)
class Signal:
    """Acceleration of the tip as a signal: name, table, its two columns there, and their directions."""

    name: str
    table: str
    columns: tuple[int, int]
    axes: tuple[str, str]


PREDICTION = Signal("predicted", "acceleration", (0, 1), ("forward", "up"))
SIGNALS = (
    Signal("measured by the IMU", "force", (0, 1), ("along the last section", "across it")),
    Signal("estimated from all sensors", ESTIMATE, (4, 5), ("forward", "up")),
    PREDICTION,
)
"""The best first: the prediction contains no vibration by disturbance forces."""

SPECTRUM_SPAN = 40.0  # time span of the spectrum, up to the shown time, s


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Spectrum: frequencies (k,) in Hz, one-sided densities (k, c) in (m/s^2)^2/Hz, peaks of their sum by frequency.

    A peak has a ``frequency`` and a ``density``.
    """

    frequencies: Array
    densities: Array
    peaks: list[dict[str, float]]


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
    peaks = sorted(_peaks(frequencies, densities.sum(axis=1), rate), key=lambda peak: peak["frequency"])
    return Spectrum(frequencies, densities, peaks)


def _peaks(frequencies: Array, density: Array, rate: float) -> list[dict[str, float]]:
    """Return the highest prominent peaks. Their frequency is from a parabola through the decibels."""
    max_peaks = 5
    lowest_peak, highest_peak = 0.3, 30.0  # frequencies of peaks, Hz
    level = 10.0 * np.log10(np.maximum(density, 1e-30))
    found, _ = find_peaks(level, prominence=6.0)  # dB
    found = [i for i in found if lowest_peak <= frequencies[i] <= min(highest_peak, 0.4 * rate)]
    peaks = []
    for i in sorted(found, key=lambda place: -level[place])[:max_peaks]:
        below, top, above = level[i - 1 : i + 2]
        bend = below - 2.0 * top + above
        offset = 0.5 * (below - above) / bend if bend else 0.0
        frequency = float(frequencies[i] + offset * (frequencies[1] - frequencies[0]))
        peaks.append({"frequency": frequency, "density": float(density[i])})
    return peaks


class Analyst:
    """Analysis of one feed, one computation at a time, because the model has one workspace."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._modes: ModeList | None = None
        self._turn = asyncio.Lock()
        self._known: tuple[tuple[int, int], tuple[dict[str, Any], bytes]] | None = None

    async def spectrum_at(self, time: float) -> tuple[dict[str, Any], bytes] | None:
        """Return text message ``lines`` and binary block of the spectrum at `time` (s); None without enough of a signal."""
        async with self._turn:
            store = self._feed.store
            signal = self._signal(time)
            table = store.tables.get(signal.table)
            if table is None:
                return None
            end = table.until(time)
            key = (store.generation, end)
            if self._known is not None and self._known[0] == key:
                return self._known[1]
            times, values = table.rows(table.until(time - SPECTRUM_SPAN), end)
            found = await asyncio.to_thread(spectrum, times, values[:, signal.columns].astype(float))
            if found is None:
                return None
            strokes = self._feed.strokes_between(time - SPECTRUM_SPAN, time)
            moved = float(np.ptp(strokes, axis=0).max()) if strokes.size else 0.0
            natural = await asyncio.to_thread(self._natural, strokes)
            number = list(store.tables).index(signal.table)
            block = pack(SPECTRUM, number, found.frequencies, found.densities.astype("f4"))
            peaks = [self._placed(peak, natural if moved <= MOVED else []) for peak in found.peaks]
            lines = {"kind": "lines", "natural": natural, "peaks": peaks, "source": signal.name, "axes": signal.axes}
            self._known = key, ({**lines, "moved": moved if moved > MOVED else 0.0}, block)
            return self._known[1]

    def _signal(self, time: float) -> Signal:
        """Return the best acceleration that has values in the last segment before `time` (s)."""
        known_share = 0.9  # share of the rows of a signal that must have a value
        for signal in SIGNALS:
            table = self._feed.store.tables.get(signal.table)
            if table is not None:
                _, values = table.rows(table.until(time - SEGMENT), table.until(time))
                if len(values) and np.isfinite(values[:, signal.columns]).all(axis=1).mean() > known_share:
                    return signal
        return PREDICTION

    @staticmethod
    def _placed(peak: dict[str, float], natural: list[float]) -> dict[str, Any]:
        """Return a peak with the number of its mode and its deviation from the model; None without a mode near it."""
        if (mode := nearest_mode(peak["frequency"], natural)) is None:
            return {**peak, "mode": None, "deviation": None}
        return {**peak, "mode": mode + 1, "deviation": peak["frequency"] / natural[mode] - 1.0}

    def _natural(self, strokes: Array) -> list[float]:
        """Return the natural frequencies (Hz) at the last of the strokes (k, n); none if they or the scene are not known."""
        scene = self._feed.scene()
        if scene is None or not len(strokes) or strokes.shape[1] != len(scene.joints):
            return []
        self._modes = self._modes or ModeList(scene)
        return self._modes.at(strokes[-1].tolist())
