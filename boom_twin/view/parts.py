"""Picture of what parts of a model cost: a bar for the error of leaving each out, beside one for the time it saves."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..records import Array
from .style import BLUE, GREEN, GREY, INK, ORANGE, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
