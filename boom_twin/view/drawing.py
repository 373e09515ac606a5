"""Symbols of an engineering sketch, in metres on equal axes: base, pin, link, cylinder, section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..records import Array
from .style import BLUE, GREY, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEEL, RIGID, BARREL, ROD = "#C9D6E2", "#8FA3B5", "#E6B98A", "#B9742F"


def draw_base(axes: Axes, pivot: Array, size: float) -> None:
    """Triangle under a pivot (m) on hatched ground; `size` is its height (m)."""
    x, y = pivot
    ground, half = y - size, 0.6 * size
    axes.fill([x - half, x, x + half], [ground, y, ground], facecolor="white", edgecolor=INK, zorder=1.5)
    axes.plot([x - size, x + size], [ground, ground], color=INK, zorder=1.5)
    for k in np.linspace(-0.85, 1.0, 7):
        dash = [x + k * size, x + (k - 0.25) * size]
        axes.plot(dash, [ground, ground - 0.25 * size], color=INK, linewidth=0.9, zorder=1.5)
    draw_pin(axes, pivot)


def draw_pin(axes: Axes, place: Array, size: float = 6.0, colour: str = INK) -> None:
    """A pin: small circle, `size` in points."""
    look: dict[str, Any] = {"markerfacecolor": "white", "markeredgecolor": colour, "markeredgewidth": 1.5}
    axes.plot(place[0], place[1], "o", markersize=size, zorder=8, **look)


def draw_link(axes: Axes, points: list[Array], colour: str = BLUE, width: float = 5.0) -> None:
    """A link through two pins, or a plate through three."""
    x, y = np.array(points).T
    if len(points) > 2:
        axes.fill(x, y, facecolor=colour, alpha=0.35, linewidth=0, zorder=5)
        axes.fill(x, y, fill=False, edgecolor=colour, linewidth=0.7 * width, joinstyle="round", zorder=5)
    else:
        axes.plot(x, y, color=colour, linewidth=width, solid_capstyle="round", zorder=5)


def draw_cylinder(axes: Axes, barrel_pin: Array, rod_pin: Array, closed_length: float, width: float) -> None:
    """Barrel from its pin, nine tenths of `closed_length` long, and the rod out of it; `width` of the barrel in m."""
    along = (rod_pin - barrel_pin) / np.hypot(*(rod_pin - barrel_pin))
    end = barrel_pin + 0.9 * closed_length * along
    _box(axes, barrel_pin, end, width, BARREL, 6.0)
    _box(axes, end, rod_pin, 0.5 * width, ROD, 5.5)


def draw_section(axes: Axes, corners: list[tuple[Array, Array, bool]], depth: float, alpha: float = 1.0) -> None:
    """Parts of a section from point to point (m); flexible ones light, rigid ones dark. `depth` in m."""
    for start, stop, flexible in corners:
        if np.hypot(*(stop - start)) > 1e-9:
            _box(axes, start, stop, depth, STEEL if flexible else RIGID, 2.0, alpha)


def _box(axes: Axes, start: Array, stop: Array, width: float, colour: str, order: float, alpha: float = 1.0) -> None:
    """Rectangle about the line from start to stop."""
    along = (stop - start) / np.hypot(*(stop - start))
    across = 0.5 * width * np.array([-along[1], along[0]])
    x, y = np.array([start + across, stop + across, stop - across, start - across]).T
    axes.fill(x, y, facecolor=colour, edgecolor=GREY, linewidth=0.9, zorder=order, alpha=alpha)
