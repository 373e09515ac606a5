"""Picture of a session's health: alarms and gaps on the time line, and how near every channel was to an alarm."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..records import Array
from .records import AlarmSpan
from .style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = (BLUE, GREEN, PURPLE, SKY, INK, GREY)
SMALLEST = 0.05
"""Level below which nothing is drawn."""


def timeline_picture(
    path: Path,
    session: str,
    end: float,
    alarms: list[AlarmSpan],
    stamps: Array,
    names: tuple[str, ...],
    levels: Array,
    note: str,
) -> None:
    """Write it.

    Parameters
    ----------
    path : Path
    session : str
        Its name.
    end : float
        Last time of the session, s.
    alarms : list of AlarmSpan
        Gaps among them.
    stamps : ndarray, shape (m,)
        s.
    names : tuple of str
        Of the channels.
    levels : ndarray, shape (m, channels)
        1 is an alarm.
    note : str
    """
    height = 4.2 + 0.45 * max(len(alarms), 1)
    with picture(path, f"{session}: alarms, and how near they were", note, (16.0, height)) as figure:
        ratios = [0.45 * max(len(alarms), 1) + 0.3, 3.0]
        upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": ratios})
        _bars(upper, alarms, end)
        _levels(lower, stamps, names, levels)
        lower.set_xlim(0.0, max(end, 1e-3))
        lower.set_xlabel("time since first sample, s")


def _bars(axes: Axes, alarms: list[AlarmSpan], end: float) -> None:
    """One bar for each, the first on top."""
    axes.grid(axis="y", visible=False)
    axes.set_ylim(max(len(alarms), 1) - 0.4, -0.6)
    axes.set_yticks(range(len(alarms)), [alarm.channel for alarm in alarms])
    if not alarms:
        axes.set_yticks([])
        axes.text(0.5, 0.5, "no alarm", transform=axes.transAxes, ha="center", va="center", color=GREEN)
    for row, alarm in enumerate(alarms):
        axes.barh(row, max(alarm.stop - alarm.start, 0.004 * end), left=alarm.start, height=0.7, color=ORANGE, alpha=0.45)
        late = alarm.start > 0.7 * end
        axes.annotate(
            alarm.label, (alarm.start, row), xytext=(-6 if late else 6, 0), textcoords="offset points", va="center",
            ha="right" if late else "left", color=INK,
        )  # fmt: skip


def _levels(axes: Axes, stamps: Array, names: tuple[str, ...], levels: Array) -> None:
    axes.set_title("Level of every channel: 1 is an alarm")
    for i, name in enumerate(names):
        values = np.maximum(levels[:, i], SMALLEST) if len(levels) else np.zeros(0)
        axes.semilogy(stamps, values, color=COLOURS[i % len(COLOURS)], label=name)
    axes.axhline(1.0, color=ORANGE, linewidth=1.6)
    axes.set_ylim(SMALLEST, max(2.0, float(levels.max(initial=1.0)) * 1.5))
    if names:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=8, borderaxespad=0.1, handlelength=1.2)
