"""Pictures of results about sessions: alarms, frequencies, loads, trends, identified modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..types import Array
from .history import AlarmSpan, History
from .style import BLUE, GREEN, GREY, INK, ORANGE, SKY, TIME, extent, legend_above, limits, picture, shade_gaps

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


@dataclass(frozen=True)
class Trend:
    """Figure of k sessions: name with unit, ascending times (s since 1970), values, standard deviations (0: not known)."""

    label: str
    times: Sequence[float]
    values: Sequence[float]
    sigmas: Sequence[float]


def trends_picture(path: Path, title: str, trends: Sequence[Trend]) -> None:
    """Draw every figure over the time of its sessions, with its value in the first and in the last of them."""
    rows = -(-len(trends) // 2)
    with picture(path, title, "", (16.0, 0.8 + 2.4 * rows)) as figure:
        panels = figure.subplots(rows, 2, squeeze=False, sharex=True)
        for axes, trend in zip_longest(panels.flat, trends):
            if trend is None:
                axes.set_axis_off()
                continue
            times = np.asarray(trend.times).astype("datetime64[s]")
            axes.errorbar(times, trend.values, trend.sigmas, color=SKY, marker="o", markerfacecolor=BLUE, ecolor=GREY)
            axes.set_title(f"{trend.label}: {trend.values[0]:.4g} in the first session, {trend.values[-1]:.4g} in the last")
            axes.ticklabel_format(axis="y", useOffset=False)
            axes.xaxis.set_tick_params(labelbottom=True)


def stabilisation_picture(path: Path, title: str, poles: Array, modes: Array, model: Array) -> None:
    """Draw poles, identified modes, and natural frequencies of the model (k,), Hz.

    `poles` (p, 3): frequency (Hz), model order, and 1 if stable, else 0. `modes` (m, 2): frequencies and deviations, Hz.
    """
    with picture(path, title, "a pole is stable if it stays the same at the next model order") as figure:
        axes = figure.subplots()
        for is_stable, colour, size, label in ((0.0, GREY, 9, "pole"), (1.0, BLUE, 22, "stable pole")):
            own = poles[poles[:, 2] == is_stable]
            axes.scatter(own[:, 0], own[:, 1], s=size, color=colour, label=label, linewidths=0)
        for number, (frequency, sigma) in enumerate(modes):
            low, high = frequency - 2.0 * sigma, frequency + 2.0 * sigma
            axes.axvspan(low, high, color=BLUE, alpha=0.2, linewidth=0, label="" if number else "mode, two deviations")
        for number, frequency in enumerate(model):
            axes.axvline(frequency, color=ORANGE, linestyle=":", label="" if number else "model")
        axes.set_xlabel("frequency, Hz")
        axes.set_ylabel("model order")
        highest = max(np.max(poles[:, 0], initial=1.0), np.max(modes[:, 0], initial=1.0))
        axes.set_xlim(0.0, 1.02 * float(highest))
        legend_above(axes, 4)
