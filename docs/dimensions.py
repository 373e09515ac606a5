"""Dimension lines, angles and labels of a drawing, in metres on equal axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from boom_twin.plots.style import GREY, INK
from boom_twin.types import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes


SIZE = 14.0  # of text, points


def dimension(axes: Axes, start: Array, stop: Array, text: str, shift: float, colour: str = INK, at: float = 0.5) -> None:
    """Dimension line from `start` to `stop` (m), moved by `shift` (m) to the left of that direction.

    The text stands at the share `at` of the way, outside where that is below 0 or above 1.
    """
    along = (stop - start) / np.hypot(*(stop - start))
    aside = shift * np.array([-along[1], along[0]])
    for end in (start, stop):
        axes.plot(*np.array([end, end + 1.06 * aside]).T, color=GREY, linewidth=0.8, zorder=9)
    _arrow(axes, start + aside, stop + aside, "<|-|>", colour, 1.1)
    turn = float(np.degrees(np.arctan2(along[1], along[0])))
    turn -= 180.0 * round(turn / 180.0) if abs(turn) > 90.0 else 0.0
    _boxed(axes, start + at * (stop - start) + aside, text, colour, rotation=turn)


def span(axes: Axes, start: Array, stop: Array, text: str, place: float, across: bool = False, at: float = 0.5) -> None:
    """Horizontal dimension between the x of two points at height `place` (m); `across`: vertical, at x = `place`.

    Text as in `dimension`.
    """
    ends = [np.array([place, end[1]] if across else [end[0], place]) for end in (start, stop)]
    for point, end in zip((start, stop), ends, strict=True):
        axes.plot(*np.array([point, end]).T, color=GREY, linewidth=0.8, zorder=1.8)
    _arrow(axes, ends[0], ends[1], "<|-|>", INK, 1.1)
    _boxed(axes, ends[0] + at * (ends[1] - ends[0]), text, INK, rotation=90.0 if across and 0.0 < at < 1.0 else 0.0)


def angle(axes: Axes, centre: Array, start: float, stop: float, radius: float, text: str, colour: str = INK) -> None:
    """Arrow on an arc about `centre` from angle `start` to `stop` (rad), with its name beside it."""
    arc = np.linspace(start, stop, 60)
    line = centre + radius * np.stack([np.cos(arc), np.sin(arc)], axis=1)
    axes.plot(*line.T, color=colour, linewidth=1.3, zorder=9)
    _arrow(axes, line[-3], line[-1], "-|>", colour, 1.3)
    middle = 0.5 * (start + stop)
    _boxed(axes, centre + radius * np.array([np.cos(middle), np.sin(middle)]), text, colour)


def name(axes: Axes, point: Array, text: str, offset: tuple[float, float], colour: str = INK, weight: str = "bold") -> None:
    """Text beside a point, `offset` in points."""
    side = "left" if offset[0] > 0 else "right" if offset[0] < 0 else "center"
    axes.annotate(
        text, _pair(point), xytext=offset, textcoords="offset points", ha=side, va="center", fontsize=SIZE,
        color=colour, weight=weight, zorder=12,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )  # fmt: skip


def leader(axes: Axes, point: Array, text: str, offset: tuple[float, float]) -> None:
    """Text `offset` points away from a point, with a thin line to it."""
    line = {"arrowstyle": "-", "color": GREY, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate(
        text, _pair(point), xytext=offset, textcoords="offset points", ha="center", va="center", fontsize=SIZE,
        color=INK, arrowprops=line, zorder=12, bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )  # fmt: skip


def frame(axes: Axes, origin: Array, heading: float, length: float, names: tuple[str, str], colour: str) -> None:
    """Axes x and y at `origin`, turned by `heading` (rad), `length` m long."""
    for k, text in enumerate(names):
        turn = heading + 0.5 * np.pi * k
        end = origin + length * np.array([np.cos(turn), np.sin(turn)])
        _arrow(axes, origin, end, "-|>", colour, 1.8)
        offset = 13.0 * np.array([np.cos(turn), np.sin(turn)])
        axes.annotate(
            text, _pair(end), xytext=_pair(offset), textcoords="offset points", ha="center", va="center", fontsize=SIZE,
            color=colour, weight="bold", zorder=12,
        )  # fmt: skip


def mass_centre(axes: Axes, point: Array, size: float = 13.0) -> None:
    """The usual symbol, a circle with a cross; `size` in points."""
    axes.plot(*point, "o", markersize=size, markerfacecolor="white", markeredgecolor=INK, markeredgewidth=1.3, zorder=9)
    axes.plot(*point, "+", markersize=size, color=INK, markeredgewidth=1.3, zorder=9)


def _arrow(axes: Axes, start: Array, stop: Array, style: str, colour: str, width: float) -> None:
    look = {"arrowstyle": style, "color": colour, "linewidth": width, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 14}
    axes.annotate("", _pair(stop), _pair(start), arrowprops=look, zorder=9)


def _pair(point: Array) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _boxed(axes: Axes, place: Array, text: str, colour: str, rotation: float = 0.0) -> None:
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}
    axes.text(
        place[0], place[1], text, ha="center", va="center", rotation=rotation, rotation_mode="anchor",
        fontsize=SIZE, color=colour, zorder=11, bbox=box,
    )  # fmt: skip
