"""Pictures of the deflected boom through a session, and of journals in their bushes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..types import Array
from .boom import draw_base
from .history import History, Orbits
from .style import GREEN, GREY, INK, ORANGE, TIME, broken, colours_of_times, picture, side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_LINES = 24


def posture_picture(path: Path, session: str, history: History, note: str) -> None:
    """Write the picture of the deflected boom at instants of a session."""
    with picture(path, f"{session}: deflected boom through the session", note) as figure:
        axes = figure.add_subplot()
        side_view(axes)
        colours = colours_of_times(figure, axes, history.stamps_s, TIME)
        chosen = [history.shapes[k] for k in spread(len(history.shapes), MOST_LINES)]
        for stamp, line in chosen[1:-1]:
            axes.plot(*line.T, color=colours(stamp), linewidth=1.4)
        _, tip = broken(history.stamps_s, history.tip_position, history.gaps)
        axes.plot(*tip.T, color=ORANGE, linewidth=1.2, label="tip trace")
        for (stamp, line), colour, name in zip(chosen[:1] + chosen[-1:], (GREEN, INK), ("first", "last"), strict=False):
            axes.plot(*line.T, color=colour, linewidth=3.2, label=f"{name}, at {stamp:.1f} s")
            axes.plot(*line[-1], "o", color=colour, markersize=8)
        for number, middle in enumerate(history.section_middles if chosen else (), 1):
            _name_section(axes, chosen[-1][1], middle, number)
        draw_base(axes, chosen[0][1][0] if chosen else np.zeros(2), 0.45)
        axes.margins(0.06)
        axes.legend(loc="upper right")


def _name_section(axes: Axes, line: Array, middle: int, number: int) -> None:
    from matplotlib.patheffects import withStroke

    (x, y), along = line[middle], line[min(middle + 1, len(line) - 1)] - line[max(middle - 1, 0)]
    across = np.array([along[1], -along[0]]) / max(float(np.hypot(*along)), 1e-9)
    axes.annotate(
        f"section {number}", (x, y), tuple(across * [42, 16]), textcoords="offset points", ha="center", va="center",
        fontsize=12, color=INK, zorder=10, path_effects=[withStroke(linewidth=3.0, foreground="white")],
    )  # fmt: skip


def spread(count: int, most: int) -> list[int]:
    """Return at most `most` of `count` indices, evenly spaced, with the first and the last."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, most))}) if count else []


COLUMNS = 4
PANEL_WIDTH = 4.2  # width of a panel, hundreds of pixels
MICRO = 1e6
ROOM = 1.25  # least half width of a panel, in clearances


def orbits_picture(path: Path, title: str, orbits: Orbits, note: str = "") -> None:
    """Write the picture of journal paths, one panel per pin."""
    columns = max(2, min(COLUMNS, len(orbits.names)))
    rows = -(-len(orbits.names) // columns)
    with picture(path, title, note, (PANEL_WIDTH * columns + 1.0, PANEL_WIDTH * rows + 1.1)) as figure:
        panels = figure.subplots(rows, columns, squeeze=False)
        colours = colours_of_times(figure, panels, orbits.times, "time, s (orange: in flight)")
        for number, axes in enumerate(panels.flat):
            if number < len(orbits.names):
                _panel(axes, orbits, number, colours)
            else:
                axes.axis("off")


def _panel(axes: Axes, orbits: Orbits, number: int, colours: Callable[[Any], Any]) -> None:
    from matplotlib.patches import Circle

    clearance, own = MICRO * float(orbits.clearances[number]), orbits.pins[:, number]
    x, y = MICRO * own[:, 0], MICRO * own[:, 1]
    free = own[:, 3] == 0.0
    axes.add_patch(Circle((0.0, 0.0), clearance, fill=False, edgecolor=INK, linewidth=1.4, zorder=2))
    axes.plot(x, y, color=GREY, linewidth=0.5, zorder=3)
    axes.scatter(x[~free], y[~free], s=9, color=colours(orbits.times[~free]), linewidths=0, zorder=4)
    axes.scatter(x[free], y[free], s=9, color=ORANGE, linewidths=0, zorder=5)
    reach = 1.05 * max(ROOM * clearance, float(np.abs([x, y]).max()))
    axes.set(aspect="equal", xlim=(-reach, reach), ylim=(-reach, reach), xlabel="x, µm", ylabel="y, µm")
    axes.set_title(f"{orbits.names[number]}: lost {orbits.lost[number]} times")
