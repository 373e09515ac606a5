"""Residuals and the tip's spectrum of a session: their distributions and densities, and the pictures of both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..analysis.sample_series import SEGMENT, ColumnStatistics, power_density, spacing, unbroken
from ..types import Array, sensor_kind
from .history import Density, History, ResidualDistribution, SessionDistributions, extremes
from .style import BLUE, GREY, INK, ORANGE, PURPLE, SKY, TIME, extent, legend_above, picture, shade_alarms, shade_gaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes


EDGES = np.linspace(-5.0, 5.0, 51)  # edges of the bins of normalised residuals; residuals outside count in the outermost bins


class SessionDistributionsBuilder:
    """Distributions and spectra of a session, from its parts."""

    def __init__(self) -> None:
        self._channels: dict[str, _Channel] = {}
        self._measured: list[Density] = []
        self._predicted: list[Density] = []

    def add(self, history: History) -> None:
        """Add a part, with all its rows."""
        for name, trace in history.residuals.items():
            self._channels.setdefault(name, _Channel()).add(trace.values, trace.sigmas)
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


SIGMA = "\N{GREEK SMALL LETTER SIGMA}"


def residual_picture(path: Path, session: str, history: History, note: str) -> None:
    """Write ``residuals.png``."""
    channels, found = len(history.residuals), distributions_of(history).residuals
    height = max(9.0, 1.2 + 1.5 * channels)
    with picture(path, f"{session}: residuals, measured minus predicted", note, (16.0, height)) as figure:
        grid = figure.add_gridspec(channels, 2, width_ratios=[5.0, 1.0])
        panels: list[Axes] = []
        for channel, name in enumerate(history.residuals):
            panels.append(figure.add_subplot(grid[channel, 0], sharex=panels[0] if panels else None))
            panels[-1].tick_params(labelbottom=channel == channels - 1)
            _channel(panels[-1], history, name, found[name].reach)
        panels[-1].set_xlabel(TIME)
        legend_above(panels[0], 5, handlelength=1.4, markerscale=4)
        _distributions(figure.add_subplot(grid[:, 1]), [found[name] for name in history.residuals])


def _channel(axes: Axes, history: History, name: str, reach: float) -> None:
    bins = 1000.0  # of time, in which curves are drawn by their extremes: one and a half pixels each
    factor, unit = sensor_kind(name).shown_unit
    trace = history.residuals[name]
    measured = np.isfinite(trace.values) & np.isfinite(trace.sigmas)
    stamps, values, sigma = trace.stamps_s[measured], factor * trace.values[measured], factor * trace.sigmas[measured]
    shade_gaps(axes, history.gaps)
    shade_alarms(axes, [alarm for alarm in history.alarms if alarm.channel == name])
    narrow = name.replace("cylinder_", "cylinder\n")  # the panel is lower than the name is long
    axes.set_ylabel(f"{narrow}\n{unit}")
    if not stamps.size:
        axes.text(0.5, 0.5, "no samples", transform=axes.transAxes, ha="center", va="center", color=GREY)
        return
    means, places = factor * trace.means[measured], (stamps - stamps[0]) / max(stamps[-1] - stamps[0], 1e-9)
    few = extremes((bins * places).astype(np.int64), [sigma, means])
    at, sigma = stamps[few], sigma[few]
    axes.fill_between(at, -3 * sigma, 3 * sigma, color=SKY, alpha=0.22, linewidth=0, label=f"±3 {SIGMA} expected")
    axes.plot(stamps, values, ".", color=BLUE, markersize=2.6, alpha=0.55, markeredgewidth=0, label="residual")
    axes.plot(at, sigma, color=INK, linewidth=1.0, label=f"±1 {SIGMA}")
    axes.plot(at, -sigma, color=INK, linewidth=1.0)
    axes.plot(at, means[few], color=ORANGE, linewidth=1.6, label="mean over 1 s")
    axes.set_ylim(-factor * reach, factor * reach)
    axes.set_xlim(extent(stamps))


def running_mean(stamps: Array, values: Array, over: float = 1.0) -> Array:
    """Return the mean of all samples within half of `over` (s) of each one, shape (k, ..); `stamps` (k,) ascending, no NaN."""
    total = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    first = np.searchsorted(stamps, stamps - 0.5 * over)
    last = np.searchsorted(stamps, stamps + 0.5 * over, side="right")
    return np.asarray(((total[last] - total[first]).T / np.maximum(last - first, 1)).T)


def _distributions(axes: Axes, found: list[ResidualDistribution]) -> None:
    """Draw the distributions of all channels, each beside its residuals."""
    gap, normal = 0.12, np.exp(-0.5 * EDGES**2) / np.sqrt(2.0 * np.pi)  # gap between two channels, relative to their distance
    for foot, own in zip(range(len(found))[::-1], found, strict=True):
        density = own.counts / (max(own.counts.sum(), 1) * np.diff(EDGES))
        scale = 0.95 * (1.0 - gap) / max(density.max(), normal.max())
        axes.plot(EDGES, foot + scale * normal, color=INK, linewidth=1.2)
        if own.mean is not None:
            axes.stairs(foot + scale * density, EDGES, baseline=foot, fill=True, color=SKY, alpha=0.8, linewidth=0)
            text = f"mean {own.mean:+.2f}\nsd {own.deviation:.2f}"
            axes.text(0.98 * EDGES[-1], foot + 0.97 * (1.0 - gap), text, ha="right", va="top", fontsize=11, color=INK)
    axes.set(title="against the unit normal", xlabel=f"residual / {SIGMA}", xticks=[-3, 0, 3], yticks=range(len(found)))
    axes.set(xlim=EDGES[[0, -1]], ylim=(0.0, len(found) - gap))
    axes.tick_params("y", length=0, labelleft=False)
    axes.spines["left"].set_visible(False)


def spectrum_picture(path: Path, session: str, history: History, note: str) -> None:
    """Write ``spectrum.png``: specific force if there is an IMU, else tip acceleration."""
    found = distributions_of(history)
    quantity = "tip acceleration" if found.measured is None else "specific force at the tip"
    names = ("x (forward)", "y (up)") if found.measured is None else ("x, along the tip", "z, across it")
    with picture(path, f"{session}: spectrum of the {quantity}", note) as figure:
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        for i, axes in enumerate(panels):
            if found.measured is not None:
                axes.loglog(*_curve(found.measured[i]), color=GREY, label="measured")
            axes.loglog(*_curve(found.predicted[i]), color=(BLUE, ORANGE)[i], linewidth=1.8, label="predicted")
            axes.set_title(f"{quantity[0].upper()}{quantity[1:]}, {names[i]}")
            axes.set_xlabel("frequency, Hz")
            axes.minorticks_off()
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_formatter("{x:g}")  # powers of ten need mathtext, which takes 0.2 s
            _modes(axes, history.natural)
            legend_above(axes, 2)
        panels[0].set_ylabel("power spectral density, (m/s²)²/Hz")
        text = f"Welch, segments of {SEGMENT:g} s, Hann window, mean removed; bands: modes of the model"
        panels[0].text(0.02, 0.02, text, transform=panels[0].transAxes, fontsize=11, color=GREY)


def _modes(axes: Axes, natural: Array) -> None:
    for number, (low, high) in enumerate(natural, 1):
        axes.axvspan(low, max(high, 1.01 * low), color=PURPLE, alpha=0.25, linewidth=0, zorder=0.5)
        place = np.sqrt(low * high), 0.99
        axes.annotate(
            f"mode {number}" if number == 1 else f"{number}", place, xycoords=axes.get_xaxis_transform(), ha="center", va="top",
            fontsize=11, color=PURPLE,
        )  # fmt: skip


def has_spectrum(history: History) -> bool:
    shortest_spectrum = 4.0  # s; no spectrum of less
    return bool(len(history.stamps_s) > 16 and history.stamps_s[-1] - history.stamps_s[0] >= shortest_spectrum)


def _curve(found: Density) -> tuple[Array, Array]:
    return found.frequencies, found.power
