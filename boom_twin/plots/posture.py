"""Pictures of postures: the deflected boom through a session, and journals in their bushes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .boom import draw_base
from .history import History, Orbits
from .style import GREEN, GREY, INK, ORANGE, broken, extent, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap


MOST_LINES = 24


def posture_picture(path: Path, session: str, history: History, note: str) -> None:
    """Write ``posture.png``."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    colours = LinearSegmentedColormap.from_list("time", ["#D6E6F2", "#5A9BCB", "#08306B"])
    with picture(path, f"{session}: deflected boom through the session", note) as figure:
        axes = figure.add_subplot()
        axes.set_aspect("equal", adjustable="datalim")
        chosen = [history.shapes[k] for k in spread(len(history.shapes), MOST_LINES)]
        span = Normalize(*extent(history.stamps_s))
        for stamp, line in chosen[1:-1]:
            axes.plot(line[:, 0], line[:, 1], color=colours(span(stamp)), linewidth=1.4)
        _, tip = broken(history.stamps_s, history.tip_position, history.gaps)
        axes.plot(tip[:, 0], tip[:, 1], color=ORANGE, linewidth=1.2, label="tip trace")
        for (stamp, line), colour, name in zip(chosen[:1] + chosen[-1:], (GREEN, INK), ("first", "last"), strict=False):
            axes.plot(line[:, 0], line[:, 1], color=colour, linewidth=3.2, label=f"{name}, at {stamp:.1f} s")
            axes.plot(*line[-1], "o", color=colour, markersize=8)
        draw_base(axes, chosen[0][1][0] if chosen else np.zeros(2), 0.45)
        axes.margins(0.06)
        axes.set_xlabel("x forward, m")
        axes.set_ylabel("y up, m")
        axes.legend(loc="upper right")
        bar = figure.colorbar(ScalarMappable(span, colours), ax=axes, shrink=0.7, pad=0.01)
        bar.set_label("time since first sample, s")
        bar.outline.set_edgecolor(GREY)


def spread(count: int, most: int) -> list[int]:
    """Return at most `most` of `count` places, evenly spread, with the first and the last."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, most))}) if count else []


COLUMNS = 4
WIDTH = 4.2  # of a panel, hundreds of pixels
MICRO = 1e6
ROOM = 1.25  # clearances from the middle of a bush to the edge of its panel, at least


def orbits_picture(path: Path, title: str, orbits: Orbits, note: str = "") -> None:
    """Write one panel a pin."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    colours = LinearSegmentedColormap.from_list("time", ["#C6DDF0", "#5A9BCB", "#08306B"])
    columns = max(2, min(COLUMNS, len(orbits.names)))
    rows = -(-len(orbits.names) // columns)
    with picture(path, title, note, (WIDTH * columns + 1.0, WIDTH * rows + 1.1)) as figure:
        panels = figure.subplots(rows, columns, squeeze=False)
        for number, axes in enumerate(panels.flat):
            if number < len(orbits.names):
                _panel(axes, orbits, number, colours)
            else:
                axes.axis("off")
        span = Normalize(*extent(orbits.times))
        bar = figure.colorbar(ScalarMappable(span, colours), ax=panels, shrink=0.8, pad=0.01)
        bar.set_label("time, s (orange: in flight)")
        bar.outline.set_edgecolor(GREY)


def _panel(axes: Axes, orbits: Orbits, number: int, colours: Colormap) -> None:
    from matplotlib.patches import Circle

    clearance, own = MICRO * float(orbits.clearances[number]), orbits.pins[:, number]
    x, y = MICRO * own[:, 0], MICRO * own[:, 1]
    free = own[:, 3] == 0.0
    share = np.linspace(0.0, 1.0, len(x)) if len(x) > 1 else np.zeros(1)
    axes.add_patch(Circle((0.0, 0.0), clearance, fill=False, edgecolor=INK, linewidth=1.4, zorder=2))
    axes.plot(x, y, color=GREY, linewidth=0.5, zorder=3)
    axes.scatter(x[~free], y[~free], s=9, color=colours(share[~free]), linewidths=0, zorder=4)
    axes.scatter(x[free], y[free], s=9, color=ORANGE, linewidths=0, zorder=5)
    reach = 1.05 * max(ROOM * clearance, float(np.abs([x, y]).max()))
    axes.set_aspect("equal")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_title(f"{orbits.names[number]}: lost {orbits.lost[number]} times")
    axes.set_xlabel("x, µm")
    axes.set_ylabel("y, µm")
