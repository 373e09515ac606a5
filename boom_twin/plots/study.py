"""Pictures of the studies: error over run time, cost of parts, verdicts by case and method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .style import INK, PALE, PURPLE, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


STAR: dict[str, Any] = {"marker": "*", "markersize": 20, "color": PURPLE, "markeredgecolor": "white", "linewidth": 0}
RING: dict[str, Any] = {"marker": "o", "markersize": 11, "markerfacecolor": "none", "markeredgewidth": 1.2}
SMALL = 10.5  # points, of notes and of legends
WIDE = 25  # characters; legends with a longer entry have one column


@dataclass(frozen=True)
class Curve:
    """One method at several steps: seconds per simulated second and errors, each (k,).

    `look` holds line properties of Matplotlib; `notes` stand at the points. Curves with the same `label` share a legend entry.
    """

    label: str
    seconds: tuple[float, ...]
    errors: tuple[float, ...]
    look: dict[str, Any]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Panel:
    """Curves on one pair of axes."""

    title: str
    label: str
    curves: tuple[Curve, ...]
    front: tuple[tuple[float, float], ...] = ()  # seconds and errors of the Pareto front, fastest first
    chosen: tuple[float, float] | None = None  # the default
    floor: float | None = None  # below it errors are not known: the references differ by so much


def work_precision_picture(path: Path, title: str, note: str, panels: Sequence[Panel], size: tuple[float, float]) -> None:
    """Write a picture of errors over run time, its panels side by side; of one scale if all have one label."""
    shared = len({panel.label for panel in panels}) == 1
    with picture(path, title, note, size) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False, sharex=shared, sharey=shared)[0]
        for axes, panel in zip(grid, panels, strict=True):
            _frame(axes, panel)
            for curve in panel.curves:
                axes.plot(_ms(curve.seconds), curve.errors, label=curve.label, **curve.look)
                _notes(axes, curve)
            _marks(axes, panel)
            handles, labels = axes.get_legend_handles_labels()
            entries = dict(zip(labels, handles, strict=True))
            columns = 1 if max(map(len, entries)) > WIDE and len(panels) > 2 else 2
            axes.legend(
                entries.values(), entries.keys(), loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=columns, fontsize=SMALL
            )
        for axes in grid[1:] if shared else ():
            axes.set_ylabel("")


def _ms(seconds: tuple[float, ...]) -> Any:
    return 1e3 * np.asarray(seconds)


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


def _notes(axes: Axes, curve: Curve) -> None:
    paper = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6}
    colour = curve.look["color"]
    for note, x, y in zip(curve.notes, _ms(curve.seconds), curve.errors, strict=False):
        if note:
            axes.annotate(note, (x, y), (9, 3), textcoords="offset points", fontsize=SMALL, color=colour, bbox=paper, zorder=6)


def _marks(axes: Axes, panel: Panel) -> None:
    if panel.front:
        x, y = np.array(panel.front).T
        look = {"color": INK, "linewidth": 1.0, "linestyle": (0, (2, 2)), "markeredgecolor": INK, "zorder": 4, **RING}
        axes.plot(1e3 * x, y, label="Pareto front", **look)
    if panel.chosen:
        axes.plot([1e3 * panel.chosen[0]], [panel.chosen[1]], label="the default, step 1 ms", zorder=7, **STAR)
    if panel.floor:
        low, _ = axes.get_ylim()
        less = "less than the references differ"
        axes.axhspan(min(low, panel.floor), panel.floor, color=PALE, alpha=0.5, linewidth=0, zorder=0.5, label=less)
        axes.set_ylim(bottom=low)
