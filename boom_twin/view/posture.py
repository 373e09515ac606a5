"""Picture of the deflected boom through a session: centre lines light to dark by time, and the tip trace."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .drawing import draw_base
from .records import History
from .style import GREEN, GREY, INK, ORANGE, broken, picture

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
        span = Normalize(float(history.stamps_s[0]), float(max(history.stamps_s[-1], history.stamps_s[0] + 1e-3)))
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
    """At most `most` of `count` places, evenly spread, with the first and the last."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, most))}) if count else []
