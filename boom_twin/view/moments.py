"""Picture of the bending moment over time at the station of every section that is loaded most."""

from __future__ import annotations

from pathlib import Path

from ..records import Array
from .records import History
from .residuals import running_mean
from .style import BLUE, ORANGE, limits, picture, shade_gaps

SLOW = 4.0
"""s of the running mean that stands for the static part."""


def moment_picture(path: Path, session: str, history: History, rows: list[tuple[str, int]], note: str) -> None:
    """Write it; `rows` are a name and the column of `history.moments` of every section."""
    title, size = f"{session}: bending moment where each section is loaded most", (16.0, 1.4 + 2.1 * len(rows))
    with picture(path, title, note, size) as figure:
        panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, column) in zip(panels, rows, strict=True):
            moment = 1e-3 * history.moments[:, column]
            shade_gaps(axes, history.gaps)
            axes.plot(history.stamps_s, moment, color=BLUE, linewidth=1.0, label="static and dynamic")
            axes.plot(history.stamps_s, slow_part(history, column) * 1e-3, color=ORANGE, label=f"mean over {SLOW:g} s")
            axes.set_ylim(*limits(moment))
            axes.set_title(name)
            axes.set_ylabel("moment, kN m")
        panels[0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1)
        panels[-1].set_xlim(history.stamps_s[0], max(history.stamps_s[-1], history.stamps_s[0] + 1e-3))
        panels[-1].set_xlabel("time since first sample, s")


def slow_part(history: History, column: int) -> Array:
    """The static part of a moment (N m), shape (m,): its mean over `SLOW`."""
    return running_mean(history.stamps_s, history.moments[:, column], SLOW)
