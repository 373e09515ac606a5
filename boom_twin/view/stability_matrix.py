"""Picture of the stability matrix: one row a case, one column a method, a letter in each cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .style import GREY, INK, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# mark: (letter, fill, ink, meaning); blue, yellow and dark red-brown differ in lightness as well as in hue
MARKS: dict[str, tuple[str, str, str, str]] = {
    "holds": ("H", "#DCE9F3", "#5B7F9B", "holds"),
    "refuses": ("R", "#FFFFFF", INK, "refuses: there is no solution, the status says so"),
    "degrades": ("D", "#F0C75E", INK, "degrades"),
    "fails": ("F", "#D55E00", "#FFFFFF", "fails, and says so"),
    "silent": ("S", "#4A0E0E", "#FFFFFF", "fails silently: wrong numbers, no word"),
}
ROW, TOP, BELOW = 0.25, 1.6, 0.9  # inches
NAMES, METHODS, ASIDE = 4.6, 0.85, 0.8  # widths, inches


@dataclass(frozen=True)
class Line:
    """A row of the matrix: `marks` (keys of MARKS), one a method."""

    group: str
    name: str
    marks: Sequence[str]


def matrix_picture(path: Path, title: str, methods: Sequence[str], lines: Sequence[Line], note: str = "") -> None:
    """Write the matrix as PNG."""
    width, height = NAMES + METHODS * len(methods) + ASIDE, TOP + ROW * len(lines) + BELOW
    with picture(path, title, note, (width, height)) as figure:
        figure.set_layout_engine("none")
        box = (NAMES / width, BELOW / height, METHODS * len(methods) / width, ROW * len(lines) / height)
        axes = figure.add_axes(box)
        _frame(axes, methods, len(lines))
        for row, line in enumerate(lines):
            new_group = row == 0 or line.group != lines[row - 1].group
            _row(axes, row, line, new_group)
        _legend(axes, len(lines), [mark for line in lines for mark in line.marks])


def _frame(axes: Axes, methods: Sequence[str], rows: int) -> None:
    axes.set_xlim(0.0, len(methods))
    axes.set_ylim(rows, 0.0)
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_visible(False)
    axes.set_xticks([i + 0.5 for i in range(len(methods))], methods, rotation=35, ha="left", fontsize=12)
    axes.xaxis.tick_top()
    axes.tick_params(length=0, pad=2)
    axes.set_yticks([])


def _row(axes: Axes, row: int, line: Line, new_group: bool) -> None:
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
        handles=handles, loc="upper left", bbox_to_anchor=(-NAMES / METHODS / axes.get_xlim()[1], -0.1 / ROW / rows),
        ncols=3, fontsize=11, borderaxespad=0.0,
    )  # fmt: skip
