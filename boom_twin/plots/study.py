"""Pictures of the studies: error over run time, cost of parts, verdicts by case and method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..types import Array
from .style import BLUE, GREEN, GREY, INK, ORANGE, PALE, PURPLE, picture

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


LEAST_ERROR = 1e-4  # mm; errors below are drawn as this
ROW = 0.3  # height of a row, hundreds of pixels


@dataclass(frozen=True)
class Bars:
    """k variants of a model, ascending in error."""

    names: tuple[str, ...]
    rest: Array  # (k,), largest distance of the tip from the full model's at rest, m
    move: Array  # (k,), likewise in a move
    saved: Array  # (k,), share of run time saved


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
        axes.barh(
            rows + shift, np.maximum(1e3 * values, LEAST_ERROR) - LEAST_ERROR, 0.36, left=LEAST_ERROR, color=colour, label=label
        )
    axes.set_xscale("log")
    axes.set_xlim(LEAST_ERROR, 2e3 * max(float(np.max([bars.rest, bars.move])), LEAST_ERROR))
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


# mark: (letter, fill, ink, meaning); blue, yellow and dark red-brown differ in lightness as well as in hue
MARKS: dict[str, tuple[str, str, str, str]] = {
    "holds": ("H", "#DCE9F3", "#5B7F9B", "holds"),
    "refuses": ("R", "#FFFFFF", INK, "refuses: there is no solution, the status says so"),
    "degrades": ("D", "#F0C75E", INK, "degrades"),
    "fails": ("F", "#D55E00", "#FFFFFF", "fails, and says so"),
    "silent": ("S", "#4A0E0E", "#FFFFFF", "fails silently: wrong numbers, no word"),
}
LINE, TOP, BELOW = 0.25, 1.6, 0.9  # inches
NAMES, METHODS, ASIDE = 4.6, 0.85, 0.8  # widths, inches


@dataclass(frozen=True)
class MatrixRow:
    """Row of the matrix: `marks` (keys of MARKS), one a method."""

    group: str
    name: str
    marks: Sequence[str]


def matrix_picture(path: Path, title: str, methods: Sequence[str], lines: Sequence[MatrixRow], note: str = "") -> None:
    """Write the matrix as PNG."""
    width, height = NAMES + METHODS * len(methods) + ASIDE, TOP + LINE * len(lines) + BELOW
    with picture(path, title, note, (width, height)) as figure:
        figure.set_layout_engine("none")
        box = (NAMES / width, BELOW / height, METHODS * len(methods) / width, LINE * len(lines) / height)
        axes = figure.add_axes(box)
        _matrix_frame(axes, methods, len(lines))
        for row, line in enumerate(lines):
            new_group = row == 0 or line.group != lines[row - 1].group
            _row(axes, row, line, new_group)
        _legend(axes, len(lines), [mark for line in lines for mark in line.marks])


def _matrix_frame(axes: Axes, methods: Sequence[str], rows: int) -> None:
    axes.set_xlim(0.0, len(methods))
    axes.set_ylim(rows, 0.0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks([i + 0.5 for i in range(len(methods))], methods, rotation=35, ha="left", fontsize=12)
    axes.xaxis.tick_top()
    axes.tick_params(length=0, pad=2)
    axes.set_yticks([])


def _row(axes: Axes, row: int, line: MatrixRow, new_group: bool) -> None:
    from matplotlib.patches import Rectangle

    left = -NAMES / METHODS
    if new_group:
        axes.plot([left + 0.1, len(line.marks)], [row, row], color=GREY, linewidth=0.8, clip_on=False)
        axes.text(left + 0.15, row + 0.5, line.group, va="center", fontsize=11, color=INK, weight="bold")
    axes.text(-0.12, row + 0.5, line.name, va="center", ha="right", fontsize=11, color=INK)
    for column, mark in enumerate(line.marks):
        letter, fill, ink, _ = MARKS[mark]
        axes.add_patch(Rectangle((column + 0.03, row + 0.06), 0.94, 0.88, facecolor=fill, edgecolor="none"))
        axes.text(column + 0.5, row + 0.53, letter, va="center", ha="center", fontsize=10.5, color=ink, weight="bold")


def _legend(axes: Axes, rows: int, present: Sequence[str]) -> None:
    from matplotlib.patches import Patch

    handles = [
        Patch(facecolor=fill, edgecolor=GREY, linewidth=0.5, label=f"{letter}  {meaning}")
        for mark, (letter, fill, _, meaning) in MARKS.items()
        if mark in present
    ]
    axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(-NAMES / METHODS / axes.get_xlim()[1], -0.1 / LINE / rows),
        ncols=3, fontsize=11, borderaxespad=0.0,
    )  # fmt: skip
