"""Pictures of a session's health: alarms over time, natural frequencies, bending moments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..types import Array
from .history import AlarmSpan, History
from .style import BLUE, GREEN, INK, ORANGE, TIME, extent, legend_above, limits, picture, shade_gaps

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def timeline_picture(path: Path, session: str, end: float, alarms: list[AlarmSpan], note: str) -> None:
    """Write the picture of the alarms of a session, gaps among them; `end` is its last time, s."""
    with picture(path, f"{session}: alarms", note, (16.0, 1.8 + 0.45 * max(len(alarms), 1))) as figure:
        axes = figure.add_subplot()
        _bars(axes, alarms, end)
        axes.set_xlim(0.0, max(end, 1e-3))
        axes.set_xlabel(TIME)


def _bars(axes: Axes, alarms: list[AlarmSpan], end: float) -> None:
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


def frequency_picture(
    path: Path, session: str, times: Array, model: Array, measured: list[tuple[float, float]], note: str
) -> None:
    """Write the picture of natural frequencies (Hz) over time.

    The model's (k, modes) are at `times` (k,) in s. A measured one is a time and a frequency.
    """
    with picture(path, f"{session}: natural frequencies", note, (16.0, 6.0)) as figure:
        axes = figure.add_subplot()
        lines = axes.semilogy(times, model, color=BLUE)
        if lines:
            lines[0].set_label("model, in the posture of the moment")
        if measured:
            axes.plot(*zip(*measured, strict=True), "o", color=ORANGE, markersize=8, label="measured")
        axes.set_xlim(extent(times))
        axes.set_ylabel("frequency, Hz")
        axes.set_xlabel(TIME)
        legend_above(axes, 2)


SLOW = 4.0  # s of the running mean that stands for the static part


def moment_picture(path: Path, session: str, history: History, rows: list[tuple[str, int]], note: str) -> None:
    """Write the picture of bending moments; `rows` are a name and the column of `history.moments` of every section."""
    title, size = f"{session}: bending moment where each section is loaded most", (16.0, 1.4 + 2.1 * len(rows))
    with picture(path, title, note, size) as figure:
        panels = figure.subplots(len(rows), 1, sharex=True, squeeze=False)[:, 0]
        for axes, (name, column) in zip(panels, rows, strict=True):
            moment = 1e-3 * history.moments[:, column]
            shade_gaps(axes, history.gaps)
            axes.plot(history.stamps_s, moment, color=BLUE, linewidth=1.0, label="static and dynamic")
            axes.plot(history.stamps_s, 1e-3 * history.slow_moments[:, column], color=ORANGE, label=f"mean over {SLOW:g} s")
            axes.set_ylim(*limits(moment))
            axes.set_title(name)
            axes.set_ylabel("moment, kN m")
        legend_above(panels[0], 2)
        panels[-1].set_xlim(extent(history.stamps_s))
        panels[-1].set_xlabel(TIME)
