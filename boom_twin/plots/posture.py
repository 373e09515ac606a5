"""Picture of journals in their bushes: the path of each in its circle of clearance, light to dark by time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .records import Orbits
from .style import GREY, INK, ORANGE, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap

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
        span = Normalize(float(orbits.times[0]), float(max(orbits.times[-1], orbits.times[0] + 1e-3)))
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
