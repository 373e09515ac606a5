"""Pictures of analyses of a scene: envelope, frequency response, steady state under a load, resonance map, error study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.envelope import Envelope
from ..analysis.frequency_response import FrequencyResponse
from ..analysis.steady_state import ResonanceMap, SteadyState
from ..scene.kinematics import skeleton
from ..scene.schema import Scene
from ..types import Array, ComplexArray
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, SKY, TONES, draw_base, legend_above, picture, side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes


COLOURS = {"kN": ORANGE, "Hz": GREEN, "kN m": PURPLE, "MPa": SKY}  # colours of bars, by unit


def envelope_picture(path: Path, scene: Scene, found: Envelope, ranges: list[tuple[str, Array]]) -> None:
    """Write the picture; `ranges` are words with unit, as in ``frequency 1, Hz``, and the values (m,) in that unit."""
    units = list(dict.fromkeys(words.rpartition(", ")[2] for words, _ in ranges))
    note = f"{len(found.names)} postures at rest"
    with picture(path, "Envelope over the working range", note, (18.0, 11.0)) as figure:
        grid = figure.add_gridspec(len(units) or 1, 2, width_ratios=[1.35, 1.0])
        _tips(figure.add_subplot(grid[:, 0]), scene, found)
        for row, unit in enumerate(units):
            own = [(words.rpartition(", ")[0], values) for words, values in ranges if words.rpartition(", ")[2] == unit]
            _bars(figure.add_subplot(grid[row, 1]), found, own, unit)


def _tips(axes: Axes, scene: Scene, found: Envelope) -> None:
    side_view(axes)
    shown = axes.scatter(
        found.tips[:, 0], found.tips[:, 1], c=1e3 * found.deflections, s=26, cmap="viridis_r", zorder=3, label="tips"
    )
    axes.figure.colorbar(shown, ax=axes, label="tip deflection, mm", shrink=0.6, location="bottom", pad=0.02)
    worst = {"largest deflection": found.deflections.argmax()}
    if found.frequencies.shape[1]:
        worst["lowest frequency"] = found.frequencies[:, 0].argmin()
    if np.isfinite(found.stresses).any():
        worst["largest stress"] = np.nan_to_num(found.stresses).max(axis=1).argmax()
    names: dict[int, list[str]] = {}
    for name, row in worst.items():
        names.setdefault(int(row), []).append(name)
    for (place, of), colour in zip(names.items(), (INK, BLUE, ORANGE), strict=False):
        bones = skeleton(scene, np.diff(np.radians(found.angles[place]), prepend=0.0))
        label = f"{' and '.join(of)}: {found.posture(place)}"
        axes.plot(*bones.pivots.T, "o-", color=colour, linewidth=2.2, markersize=5, label=label)
    draw_base(axes, np.array(scene.base.pivot), 0.035 * scene.reach)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=11)


def _bars(axes: Axes, found: Envelope, own: list[tuple[str, Array]], unit: str) -> None:
    """Draw one bar for each quantity from its least to its greatest value; values and postures of its ends are above it."""
    for place, (_, values) in enumerate(own):
        low, high = int(values.argmin()), int(values.argmax())
        axes.barh(place, values[high] - values[low], left=values[low], height=0.4, color=COLOURS.get(unit, GREY), alpha=0.8)
        ends = (f"{float(f'{values[row]:.3g}'):g} in {found.posture(row)}" for row in (low, high))
        axes.annotate(
            " to ".join(ends), (0.01, place - 0.25), xycoords=axes.get_yaxis_transform(), va="bottom", fontsize=9, color=INK
        )
    axes.use_sticky_edges = False
    axes.set_yticks(range(len(own)), [words for words, _ in own])
    axes.set_ylim(len(own) - 0.6, -0.75)
    axes.grid(False, axis="y")
    axes.set_xlabel(unit)


def response_picture(path: Path, title: str, unit: str, response: FrequencyResponse, natural: Array) -> None:
    """Draw amplitudes of tip, joint angles and cylinder forces over frequency, with lines at the `natural` frequencies, Hz."""
    per = f"per {unit}"
    panels: list[tuple[str, ComplexArray, list[str]]] = [
        (f"tip, m {per}", response.tip, ["x", "y"]),
        (f"tip acceleration, m/s² {per}", response.tip_acceleration, ["x", "y"]),
        (f"joint angles, rad {per}", response.joints, _numbered(response.joints)),
        (f"cylinder forces, N {per}", response.cylinder_forces, _numbered(response.cylinder_forces)),
    ]
    with picture(path, title, "dotted: natural frequencies without damping") as figure:
        grid = figure.subplots(2, 2, sharex=True)
        for axes, (name, values, labels) in zip(grid.flat, panels, strict=True):
            _amplitudes(axes, response.frequencies, values, labels)
            axes.set_title(name)
            for frequency in natural:
                axes.axvline(frequency, color=GREY, linewidth=0.9, linestyle=":")
            legend_above(axes, len(labels))
        for axes in grid[1]:
            axes.set_xlabel("frequency, Hz")


def _numbered(values: ComplexArray) -> list[str]:
    return [str(i + 1) for i in range(values.shape[1])]


def _amplitudes(axes: Axes, frequencies: Array, values: ComplexArray, labels: list[str]) -> None:
    from matplotlib.ticker import StrMethodFormatter

    for i, (label, column) in enumerate(zip(labels, np.abs(values).T, strict=True)):
        if np.any(column > 0.0):
            axes.plot(frequencies, column, color=TONES[i % len(TONES)][0], label=label)
    axes.set_xscale("log")
    if np.any(np.abs(values) > 0.0):
        axes.set_yscale("log")
    axes.set_xlim(frequencies[0], frequencies[-1])
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))


def steady_state_picture(path: Path, title: str, found: SteadyState) -> None:
    """Draw one period of the load and of the tip's displacement and acceleration; and the harmonics of the displacement."""
    with picture(path, title) as figure:
        grid = figure.subplots(2, 2)
        rows = [
            (grid[0, 0], "load at the tip, N", found.load.forces),
            (grid[1, 0], "tip from its place at rest, mm", 1e3 * found.tip),
            (grid[0, 1], "tip acceleration, m/s²", found.tip_acceleration),
        ]
        for axes, name, values in rows:
            for column, colour, label in zip(values.T, (BLUE, ORANGE), "xy", strict=True):
                axes.plot(found.times, column, color=colour, label=label)
            axes.set_title(name)
            axes.set_xlim(0.0, found.load.period)
            axes.set_xlabel("time in the period, s")
            legend_above(axes, 2)
        bars, count = grid[1, 1], min(25, len(found.harmonics))
        bars.bar(np.arange(1, count + 1) / found.load.period, 1e3 * found.harmonics[:count], 0.6 / found.load.period, color=INK)
        bars.set_title("harmonics of the tip's displacement, mm")
        bars.set_xlabel("frequency, Hz")


def resonance_picture(path: Path, title: str, found: ResonanceMap) -> None:
    """Draw the swing of the tip over postures (rows) and rates; rates to avoid are framed."""
    from matplotlib.colors import LogNorm

    rows, edges = len(found.postures), _edges(found.rates)
    with picture(path, title, "framed: rates to avoid", (16.0, 2.6 + max(3.0, 0.42 * rows))) as figure:
        axes = figure.subplots()
        swing = np.maximum(1e3 * found.swing, 1e-3)
        mesh = axes.pcolormesh(edges, np.arange(rows + 1) - 0.5, swing, norm=LogNorm(), cmap="cividis")
        for band in found.to_avoid():
            row = found.postures.index(band.posture)
            low, high = edges[np.searchsorted(found.rates, band.low)], edges[np.searchsorted(found.rates, band.high) + 1]
            axes.plot([low, high, high, low, low], row + 0.46 * np.array([-1, -1, 1, 1, -1]), color=ORANGE, linewidth=2.2)
        axes.set_yticks(range(rows), found.postures)
        axes.set_ylim(rows - 0.5, -0.5)
        axes.set_xlabel("pump rate, Hz")
        axes.grid(False)
        figure.colorbar(mesh, ax=axes, label="swing of the tip, peak to peak, mm")


def _edges(rates: Array) -> Array:
    """Return borders (r + 1,) between ascending `rates` (r,), and outside of the first and last."""
    if len(rates) == 1:
        return np.array([0.95, 1.05]) * rates
    middle = 0.5 * (rates[1:] + rates[:-1])
    return np.concatenate([[2.0 * rates[0] - middle[0]], middle, [2.0 * rates[-1] - middle[-1]]])


RING: dict[str, Any] = {"marker": "o", "markersize": 11, "markerfacecolor": "none", "markeredgewidth": 1.2}
SMALL = 10.5  # points, of notes and of legends
CURVES: dict[str, tuple[str, dict[str, Any]]] = {
    "other methods": ("boom_twin, all other methods", {"color": SKY, "linewidth": 0, "marker": ".", "markersize": 6}),
    "default method": ("boom_twin, default method", {"color": BLUE, "linewidth": 2.4, "marker": "o", "zorder": 5}),
    "Exudyn": ("Exudyn, by elements a section (l: lumped)", {"color": ORANGE, "linewidth": 1.6, "marker": "s"}),
    "Pareto front": ("Pareto front", {"color": INK, "linewidth": 1.0, "linestyle": (0, (2, 2)), "zorder": 4} | RING),
}
"""Legend entry and line properties of a kind of curve."""


@dataclass(frozen=True)
class Curve:
    """Seconds per simulated second and errors, each (k,), of a kind in `CURVES`; `notes` stand at the points."""

    kind: str
    seconds: Sequence[float]
    errors: Sequence[float]
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Panel:
    """Curves on one pair of axes; `chosen` is the default. Errors below `floor` are not known."""

    title: str
    label: str
    curves: Sequence[Curve]
    front: Curve  # fastest first
    chosen: tuple[float, float] | None  # seconds and error
    floor: float


def error_picture(path: Path, note: str, panels: Sequence[Panel]) -> None:
    """Write the picture of errors over run time, its panels side by side."""
    with picture(path, "Error against run time", note, (16.0, 10.4)) as figure:
        for axes, panel in zip(figure.subplots(1, len(panels)), panels, strict=True):
            _frame(axes, panel)
            for curve in panel.curves:
                _draw(axes, curve)
            _marks(axes, panel)
            handles, labels = axes.get_legend_handles_labels()
            entries = dict(zip(labels, handles, strict=True))
            axes.legend(
                entries.values(), entries.keys(), loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize=SMALL
            )


def _frame(axes: Axes, panel: Panel) -> None:
    from matplotlib.ticker import StrMethodFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.set_title(panel.title)
    axes.set_xlabel("run time, ms per simulated second")
    axes.set_ylabel(panel.label)
    axes.grid(True, which="minor", color="#F4F4F4", linewidth=0.6)


def _draw(axes: Axes, curve: Curve) -> None:
    label, look = CURVES[curve.kind]
    times, paper = 1e3 * np.array(curve.seconds), {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6}
    axes.plot(times, curve.errors, label=label, **look)
    place: dict[str, Any] = {"xytext": (9, 3), "textcoords": "offset points", "fontsize": SMALL, "zorder": 6, "bbox": paper}
    for note, x, y in zip(curve.notes, times, curve.errors, strict=False):
        if note:
            axes.annotate(note, (x, y), color=look["color"], **place)


def _marks(axes: Axes, panel: Panel) -> None:
    if panel.front.seconds:
        _draw(axes, panel.front)
    if panel.chosen:
        look: dict[str, Any] = {"color": PURPLE, "markeredgecolor": "white", "markersize": 20, "zorder": 7}
        axes.plot([1e3 * panel.chosen[0]], [panel.chosen[1]], "*", label="the default, step 1 ms", **look)
    low, _ = axes.get_ylim()
    less = "less than the references differ"
    axes.axhspan(min(low, panel.floor), panel.floor, color=PALE, alpha=0.5, linewidth=0, zorder=0.5, label=less)
    axes.set_ylim(bottom=low)
