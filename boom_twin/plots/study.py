"""Pictures of the error and parts studies: error over run time, cost of parts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..types import Array
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, SKY, TONES, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


STAR: dict[str, Any] = {"marker": "*", "markersize": 20, "color": PURPLE, "markeredgecolor": "white", "linewidth": 0}
RING: dict[str, Any] = {"marker": "o", "markersize": 11, "markerfacecolor": "none", "markeredgewidth": 1.2}
SMALL = 10.5  # points, of notes and of long legends
WIDE = 25  # characters; legends with a longer entry have one column

# family: (legend, line and marker, where its notes stand)
FAMILIES: dict[str, tuple[str, dict[str, Any], tuple[float, float]]] = {
    "own": ("boom_twin, all other methods", {"color": SKY, "linewidth": 0, "marker": ".", "markersize": 6}, (0, 0)),
    "default": ("boom_twin, default method", {"color": BLUE, "linewidth": 2.4, "marker": "o", "zorder": 5}, (9, 3)),
    "exudyn": ("Exudyn, by elements a section (l: lumped)", {"color": ORANGE, "linewidth": 1.6, "marker": "s"}, (7, -4)),
    "scipy": ("SciPy's Radau, by segments", {"color": GREEN, "linewidth": 1.6, "marker": "^", "markersize": 7}, (7, 3)),
}


@dataclass(frozen=True)
class Curve:
    """One method at several steps: wall seconds per simulated second and errors, each (k,).

    ``family`` is the legend's entry that it belongs to, a key of `FAMILIES`; `notes` stand at its points. Among own methods
    ``tone`` is its colour and marker (0 to 5, of `TONES`), and it may be `dashed`.
    """

    label: str
    family: str
    seconds: tuple[float, ...]
    errors: tuple[float, ...]
    notes: tuple[str, ...] = ()
    tone: int = 0
    dashed: bool = False


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


def work_precision_picture(path: Path, title: str, note: str, panels: tuple[Panel, ...]) -> Path:
    """Write the picture of all programs; returns `path`."""
    with picture(path, title, note, (16.0, 9.8)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False)[0]
        for axes, panel in zip(grid, panels, strict=True):
            _frame(axes, panel)
            for curve in panel.curves:
                _, look, offset = FAMILIES[curve.family]
                axes.plot(_ms(curve.seconds), curve.errors, **look)
                _notes(axes, curve, str(look["color"]), offset)
            _marks(axes, panel)
        figure.legend(handles=_legend(panels[0]), loc="outside lower center", ncols=4)
    return path


def methods_picture(path: Path, title: str, note: str, panels: tuple[Panel, ...]) -> Path:
    """Write the picture of own methods among themselves, every curve with a look of its own; returns `path`."""
    with picture(path, title, note, (19.0, 10.0)) as figure:
        grid = figure.subplots(1, len(panels), squeeze=False, sharex=True, sharey=True)[0]
        for axes, panel in zip(grid, panels, strict=True):
            _frame(axes, panel)
            for curve in panel.curves:
                colour, marker = TONES[curve.tone]
                bold = curve.family == "default"
                axes.plot(
                    _ms(curve.seconds), curve.errors, color=colour, marker=marker, markersize=7 if bold else 5.5,
                    linewidth=2.6 if bold else 1.2, linestyle=(0, (4, 2)) if curve.dashed else "-",
                    markerfacecolor="white" if curve.dashed else colour, label=curve.label, zorder=5 if bold else 3,
                )  # fmt: skip
            _marks(axes, panel)
            columns = 1 if max(len(curve.label) for curve in panel.curves) > WIDE else 2
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=columns, fontsize=SMALL)
        for axes in grid[1:]:
            axes.set_ylabel("")
    return path


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


def _notes(axes: Axes, curve: Curve, colour: str, offset: tuple[float, float]) -> None:
    """Draw small print beside those points of a curve that have any."""
    paper = {"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 0.6}
    for note, x, y in zip(curve.notes, _ms(curve.seconds), curve.errors, strict=False):
        if note:
            axes.annotate(note, (x, y), offset, textcoords="offset points", fontsize=SMALL, color=colour, bbox=paper, zorder=6)


def _marks(axes: Axes, panel: Panel) -> None:
    """Draw front, default and floor."""
    if panel.front:
        x, y = np.array(panel.front).T
        axes.plot(1e3 * x, y, color=INK, linewidth=1.0, linestyle=(0, (2, 2)), markeredgecolor=INK, zorder=4, **RING)
    if panel.chosen:
        axes.plot([1e3 * panel.chosen[0]], [panel.chosen[1]], zorder=7, **STAR)
    if panel.floor:
        low, _ = axes.get_ylim()
        axes.axhspan(min(low, panel.floor), panel.floor, color=PALE, alpha=0.5, linewidth=0, zorder=0.5)
        axes.set_ylim(bottom=low)


def _legend(panel: Panel) -> list[Any]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    used = {curve.family for curve in panel.curves}
    found: list[Any] = [Line2D([], [], label=text, **look) for name, (text, look, _) in FAMILIES.items() if name in used]
    if panel.chosen:
        found.append(Line2D([], [], label="the default, step 1 ms", **STAR | {"markersize": 15}))
    if panel.front:
        found.append(Line2D([], [], color=INK, linestyle=(0, (2, 2)), label="Pareto front", **RING))
    if panel.floor:
        found.append(Patch(color=PALE, alpha=0.5, label="less than the references differ"))
    return found


LEAST = 1e-4  # mm; errors below are drawn as this
ROW = 0.3  # height of a row, hundreds of pixels


@dataclass(frozen=True)
class Bars:
    """k variants of a model, ascending in error.

    Attributes
    ----------
    names : tuple of str
    rest, move : ndarray, shape (k,)
        Largest distance of the tip from the full model's, at rest and in a move, m.
    saved : ndarray, shape (k,)
        Share of run time saved.
    """

    names: tuple[str, ...]
    rest: Array
    move: Array
    saved: Array


def parts_picture(path: Path, bars: Bars, note: str) -> None:
    """Write the picture; the least error stands on top."""
    size = (16.0, 2.0 + ROW * len(bars.names))
    with picture(path, "What leaving a part out changes, and what it saves", note, size) as figure:
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
        rows = np.arange(float(len(bars.names)))
        _errors(left, bars, rows)
        _savings(right, bars, rows)
        left.set_yticks(rows, bars.names)
        left.set_ylim(len(rows) - 0.4, -0.6)
        for axes in (left, right):
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)


def _errors(axes: Axes, bars: Bars, rows: Array) -> None:
    for values, shift, colour, label in ((bars.rest, -0.19, BLUE, "at rest"), (bars.move, 0.19, ORANGE, "in the move")):
        axes.barh(rows + shift, np.maximum(1e3 * values, LEAST) - LEAST, 0.36, left=LEAST, color=colour, label=label)
    axes.set_xscale("log")
    axes.set_xlim(LEAST, 2e3 * max(float(np.max([bars.rest, bars.move])), LEAST))
    axes.axvline(1.0, color=GREY, linewidth=1.0, linestyle="--")
    axes.set_xlabel("largest error of the tip, mm (dashed: 1 mm)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)


def _savings(axes: Axes, bars: Bars, rows: Array) -> None:
    saved = 100.0 * bars.saved
    axes.barh(rows, saved, 0.6, color=np.where(saved >= 0.0, GREEN, GREY))
    axes.axvline(0.0, color=INK, linewidth=0.8)
    for row, value in zip(rows, np.round(saved) + 0.0, strict=True):
        side = "left" if value >= 0.0 else "right"
        axes.text(value + np.copysign(1.0, value), row, f"{value:+.0f}", va="center", ha=side, fontsize=10)
    reach = max(10.0, float(np.abs(saved).max()))
    axes.set_xlim(min(-10.0, 1.2 * float(saved.min())), 1.15 * reach)
    axes.set_xlabel("run time of a step saved, % (grey: it costs more)")
