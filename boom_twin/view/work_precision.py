"""Picture of errors over run time, both logarithmic: every method a curve, the Pareto front and the default marked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .style import BLUE, GREEN, INK, ORANGE, PALE, PURPLE, SKY, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKERS = "osD^vP<X>h"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, INK)


@dataclass(frozen=True)
class Curve:
    """One method at several steps: wall seconds per simulated second and errors, each (k,); `notes` stand at its points.

    ``family`` is the legend's entry that it belongs to: a key of `FAMILIES`.
    """

    label: str
    family: str
    seconds: tuple[float, ...]
    errors: tuple[float, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Panel:
    """Curves on one pair of axes.

    Attributes
    ----------
    front : tuple of (float, float)
        Seconds and errors of the Pareto front, fastest first.
    chosen : (float, float), optional
        The default.
    floor : float, optional
        Below it errors are not known: the references differ by so much.
    """

    title: str
    label: str
    curves: tuple[Curve, ...]
    front: tuple[tuple[float, float], ...] = ()
    chosen: tuple[float, float] | None = None
    floor: float | None = None


# family: (legend, line and marker)
FAMILIES: dict[str, tuple[str, dict[str, Any]]] = {
    "own": ("boom_twin, other methods", {"color": SKY, "linewidth": 0.7, "marker": ".", "markersize": 5, "alpha": 0.75}),
    "default": ("boom_twin, default method", {"color": BLUE, "linewidth": 2.4, "marker": "o", "markersize": 7, "zorder": 5}),
    "exudyn": ("Exudyn", {"color": ORANGE, "linewidth": 1.6, "marker": "s", "markersize": 6}),
    "scipy": ("SciPy on a finite-segment boom", {"color": GREEN, "linewidth": 1.6, "marker": "^", "markersize": 7}),
}


def work_precision_picture(path: Path, title: str, note: str, panels: tuple[Panel, ...]) -> Path:
    """Write the picture; returns `path`."""
    with picture(path, title, note, (16.0, 9.4)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False)[0]
        for axes, panel in zip(grid, panels, strict=True):
            _frame(axes, panel)
            for curve in panel.curves:
                _, look = FAMILIES[curve.family]
                axes.plot(_ms(curve.seconds), curve.errors, **look)
                _notes(axes, curve, str(look["color"]))
            _marks(axes, panel)
        grid[-1].legend(handles=_legend(panels[0]), loc="upper right", framealpha=0.9, frameon=True, edgecolor="none")
    return path


def methods_picture(path: Path, title: str, note: str, panels: tuple[Panel, ...]) -> Path:
    """The same for own methods among themselves: every curve with its own colour and marker; returns `path`."""
    with picture(path, title, note, (19.0, 8.4)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False, sharex=True, sharey=True)[0]
        for axes, panel in zip(grid, panels, strict=True):
            _frame(axes, panel)
            for i, curve in enumerate(panel.curves):
                bold = curve.family == "default"
                style = "-" if i < len(COLOURS) else "--"
                axes.plot(
                    _ms(curve.seconds), curve.errors, color=COLOURS[i % len(COLOURS)], marker=MARKERS[i % len(MARKERS)],
                    markersize=6, linewidth=2.4 if bold else 1.2, linestyle=style, label=curve.label, zorder=5 if bold else 3,
                )  # fmt: skip
            _marks(axes, panel)
            axes.legend(loc="lower left", fontsize=10.5, frameon=True, framealpha=0.9, edgecolor="none")
        for axes in grid[1:]:
            axes.set_ylabel("")
    return path


def _ms(seconds: tuple[float, ...]) -> Any:
    return 1e3 * np.asarray(seconds)


def _frame(axes: Axes, panel: Panel) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title(panel.title)
    axes.set_xlabel("run time of the stepping, ms per simulated second")
    axes.set_ylabel(panel.label)
    axes.grid(True, which="minor", color="#F3F3F3", linewidth=0.6)


def _notes(axes: Axes, curve: Curve, colour: str) -> None:
    """Small print beside the points of a curve that has any; a single note stands at its last point."""
    for note, x, y in zip(curve.notes, _ms(curve.seconds), curve.errors, strict=False):
        if note:
            axes.annotate(
                note, (x, y), xytext=(5, 6), textcoords="offset points", fontsize=10.5, color=colour, zorder=6
            )  # fmt: skip


def _marks(axes: Axes, panel: Panel) -> None:
    """Front, default, floor."""
    if panel.front:
        x, y = np.array(panel.front).T
        axes.plot(1e3 * x, y, color=INK, linewidth=1.0, linestyle=(0, (2, 2)), zorder=4)
        axes.plot(1e3 * x, y, "o", markersize=12, markerfacecolor="none", markeredgecolor=INK, markeredgewidth=1.3, zorder=6)
    if panel.chosen:
        x0, y0 = 1e3 * panel.chosen[0], panel.chosen[1]
        axes.plot([x0], [y0], "*", markersize=20, color=PURPLE, markeredgecolor="white", zorder=7)
    if panel.floor:
        low, _ = axes.get_ylim()
        axes.axhspan(min(low, panel.floor), panel.floor, color=PALE, alpha=0.5, linewidth=0, zorder=0.5)
        axes.set_ylim(bottom=low)


def _legend(panel: Panel) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    used = {curve.family for curve in panel.curves}
    found: list[Any] = [Line2D([], [], label=text, **look) for name, (text, look) in FAMILIES.items() if name in used]
    found.append(Line2D([], [], color=PURPLE, marker="*", markersize=15, linewidth=0, label="the default: step 1 ms"))
    ring: dict[str, Any] = {"marker": "o", "markersize": 11, "markerfacecolor": "none", "linestyle": (0, (2, 2))}
    found.append(Line2D([], [], color=INK, label="Pareto front", **ring))
    if panel.floor:
        found.append(Patch(color=PALE, alpha=0.5, label="less than the references differ"))
    return found



