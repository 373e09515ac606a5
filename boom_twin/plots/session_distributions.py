"""Figures of a whole session that pictures show and that do not follow from its extremes: distributions and spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..analysis.sample_series import ColumnStatistics, power_density, spacing, unbroken
from ..types import Array
from .history import Density, History, ResidualDistribution, SessionDistributions

EDGES = np.linspace(-5.0, 5.0, 51)  # edges of the bins of normalised residuals; residuals outside count in the outermost bins
SEGMENT = 8.0  # s; lines of a spectrum are 1/SEGMENT apart


class SessionDistributionsBuilder:
    """Distributions and spectra of a session, from its parts."""

    def __init__(self) -> None:
        self._channels: dict[str, _Channel] = {}
        self._measured: list[Density] = []
        self._predicted: list[Density] = []

    def add(self, history: History) -> None:
        """Add a part, with all its rows."""
        for i, name in enumerate(history.residual_names):
            self._channels.setdefault(name, _Channel()).add(history.residual_values[:, i], history.residual_sigmas[:, i])
        imu = history.imu
        if imu is None and self._measured:
            return
        if imu is None:
            self._predicted = _averaged(self._predicted, history.stamps_s, history.tip_acceleration)
        else:
            self._predicted = _averaged(self._predicted if self._measured else [], imu.stamps_s, imu.predicted)
            self._measured = _averaged(self._measured, imu.stamps_s, imu.measured)

    @property
    def distributions(self) -> SessionDistributions:
        """Distributions and spectra of all parts so far."""
        residuals = {name: channel.distribution for name, channel in self._channels.items()}
        return SessionDistributions(residuals, tuple(self._predicted), tuple(self._measured) or None)


class _Channel:
    """Distribution of the residuals of one channel."""

    def __init__(self) -> None:
        self._statistics, self._reach = ColumnStatistics(1), 0.0
        self._counts: NDArray[np.int64] = np.zeros(len(EDGES) - 1, np.int64)

    def add(self, values: Array, sigmas: Array) -> None:
        known = np.isfinite(values) & np.isfinite(sigmas)
        if not known.any():
            return
        normalised = values[known] / sigmas[known]
        self._statistics.add(normalised[:, None])
        self._counts += np.histogram(np.clip(normalised, EDGES[0], EDGES[-1]), EDGES)[0]
        large = 1.1 * float(np.quantile(np.abs(values[known]), 0.9995))
        self._reach = max(self._reach, 4.2 * float(np.median(sigmas[known])), large)

    @property
    def distribution(self) -> ResidualDistribution:
        (mean,), (deviation,) = self._statistics.mean, self._statistics.deviation
        return ResidualDistribution(self._counts.copy(), mean, deviation, self._reach)


def distributions_of(history: History) -> SessionDistributions:
    """Return the distributions of a session: its own, or those of its rows if they are all there."""
    if history.distributions is not None:
        return history.distributions
    builder = SessionDistributionsBuilder()
    builder.add(history)
    return builder.distributions


_UNKNOWN = Density(np.array([1.0]), np.array([np.nan]), 0.0, 0)


def _averaged(earlier: list[Density], stamps: Array, values: Array) -> list[Density]:
    """Return densities of both columns of `values`, averaged with those of earlier parts as by Welch over all segments."""
    found = earlier or [_UNKNOWN, _UNKNOWN]
    for part in unbroken(stamps):
        found = [_mean(each, density(stamps[part], values[part, i], each.interval)) for i, each in enumerate(found)]
    return found


def _mean(one: Density, other: Density) -> Density:
    """Return the mean of two densities, weighted by their segments; if their lines differ, the one with more lines."""
    if len(one.frequencies) != len(other.frequencies):
        return max(one, other, key=lambda each: len(each.frequencies))
    if not (count := one.segments + other.segments):
        return one
    return replace(one, power=(one.segments * one.power + other.segments * other.power) / count, segments=count)


def density(stamps: Array, values: Array, interval: float = 0.0) -> Density:
    """Return the one-sided power spectral density of `values` (k,), interpolated to even times, also across NaN.

    These are `interval` (s) apart; 0: as far as the `stamps` (k,) usually are.
    """
    known = np.isfinite(values)
    if known.sum() < 16:
        return _UNKNOWN
    interval = interval or spacing(stamps[known])
    even = np.arange(stamps[known][0], stamps[known][-1], interval)
    segment = min(len(even), round(SEGMENT / interval))
    frequencies, power, count = power_density(np.interp(even, stamps[known], values[known]), interval, segment)
    return Density(frequencies[1:], power[1:], interval, count)
