"""Picture of the error study: errors over run time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .style import BLUE, INK, ORANGE, PALE, PURPLE, SKY, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
