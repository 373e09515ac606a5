"""Pictures of the stability study."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..types import Array
from .style import BLUE, GREY, INK, ORANGE, SKY, picture

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
class MatrixRow:
    """Row of the matrix: `marks` (keys of MARKS), one a method."""

    group: str
    name: str
    marks: Sequence[str]


def matrix_picture(path: Path, title: str, methods: Sequence[str], lines: Sequence[MatrixRow], note: str = "") -> None:
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
        handles=handles, loc="upper left", bbox_to_anchor=(-NAMES / METHODS / axes.get_xlim()[1], -0.1 / ROW / rows),
        ncols=3, fontsize=11, borderaxespad=0.0,
    )  # fmt: skip


def roundoff_picture(
    path: Path, title: str, steps: Array, errors: Array, target: float, counts: Array, digits: dict[str, Array], note: str = ""
) -> None:
    """Write two panels: `errors` of the tip over `steps` (s); `digits` lost by each way of solving over `counts` sections."""
    with picture(path, title, note, (16.0, 7.0)) as figure:
        left, right = figure.subplots(1, 2)
        _errors(left, steps, errors, target)
        _digits(right, counts, digits)


def _errors(axes: Axes, steps: Array, errors: Array, target: float) -> None:
    axes.loglog(steps, errors, "o-", color=BLUE, label="default method")
    square = errors[0] * (steps / steps[0]) ** 2
    shown = square >= 0.3 * errors.min()
    axes.loglog(steps[shown], square[shown], "--", color=GREY, label="falls with the square of the step")
    axes.axhline(target, color=ORANGE, linewidth=1.0, label=f"above {target:.0e} it may not turn up")
    axes.set_xlabel("step, s")
    axes.set_ylabel("largest error of the tip / length of the boom")
    axes.set_title("error over the step: where round-off takes over")
    axes.legend(loc="lower right")


def _digits(axes: Axes, counts: Array, digits: dict[str, Array]) -> None:
    looks = zip(digits.items(), ((BLUE, "o-"), (ORANGE, "s-"), (SKY, "^--"), (INK, "v--")), strict=False)
    for (name, lost), (colour, line) in looks:
        axes.semilogx(counts, lost, line, color=colour, label=name)
    axes.axhline(16.0, color=GREY, linewidth=0.8)
    axes.text(counts[0], 15.6, "all of them", color=GREY, va="top", fontsize=11)
    axes.set_ylim(-0.5, 17.0)
    axes.set_xticks(counts, [f"{count:.0f}" for count in counts])
    axes.set_xticks([], minor=True)
    axes.set_xlim(0.9 * float(np.min(counts)), 1.1 * float(np.max(counts)))
    axes.set_xlabel("sections of a boom of 20 m")
    axes.set_ylabel("decimal digits lost in one Newton pass, of 16")
    axes.set_title("digits lost over the length of the chain, step 1 ms")
    axes.legend(loc="center right")
