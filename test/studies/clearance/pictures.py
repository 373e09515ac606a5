"""Pictures of the study of play in the pins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boom_twin.plots.style import BLUE, GREY, INK, ORANGE, TONES, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


BEFORE = 0.2  # s that are shown before a stop
LOOKS = {"ideal": (GREY, 2.4), "contact": (ORANGE, 1.3), "spring-damper": (BLUE, 1.0)}


@dataclass(frozen=True)
class Trace:
    """Tip in one posture with one kind of pins (a key of `LOOKS`): s, vertical displacement m, acceleration m/s^2."""

    posture: str
    model: str
    times: np.ndarray
    height: np.ndarray
    acceleration: np.ndarray


def swing_picture(path: Path, title: str, note: str, traces: list[Trace], until: float) -> None:
    """Write a column a posture: vertical displacement above, acceleration below, up to `until` s after the stop."""
    postures = list(dict.fromkeys(trace.posture for trace in traces))
    with picture(path, title, note, (5.0 * max(len(postures), 2), 8.6)) as figure:
        grid = figure.subplots(2, len(postures), squeeze=False, sharex=True)
        for column, posture in enumerate(postures):
            for trace in (own for own in traces if own.posture == posture):
                colour, width = LOOKS[trace.model]
                shown = (trace.times >= -BEFORE) & (trace.times <= until)
                for axes, values in zip(grid[:, column], (1e3 * trace.height, trace.acceleration), strict=True):
                    axes.plot(trace.times[shown], values[shown], color=colour, linewidth=width, label=trace.model)
            grid[0, column].set_title(posture)
            grid[1, column].set_xlabel("time after the stop, s")
        grid[0, 0].set_ylabel("height of the tip, mm\n(0: rest with ideal pins)")
        grid[1, 0].set_ylabel("vertical acceleration, m/s²")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)


@dataclass(frozen=True)
class RestOffsetCurve:
    """Distance (m) of the resting tip from that with ideal pins over clearances (m), both (k,), for one pin in a posture."""

    posture: str
    pin: str
    clearances: np.ndarray
    shifts: np.ndarray


def sinking_picture(path: Path, title: str, note: str, found: list[RestOffsetCurve], switch: float) -> None:
    """Write a panel a posture; below `switch` (m) a pin is ideal."""
    postures = list(dict.fromkeys(own.posture for own in found))
    with picture(path, title, note, (4.6 * max(len(postures), 2), 6.4)) as figure:
        grid = figure.subplots(1, len(postures), squeeze=False, sharex=True, sharey=True)[0]
        for axes, posture in zip(grid, postures, strict=True):
            for number, own in enumerate(one for one in found if one.posture == posture):
                colour, marker = TONES[number % len(TONES)]
                axes.loglog(1e6 * own.clearances, 1e3 * own.shifts, color=colour, marker=marker, markersize=4, label=own.pin)
                axes.plot([0.5e6 * switch], [1e3 * own.shifts[-1]], "<", color=colour, markersize=6)
            _switch(axes, switch)
            axes.set_title(posture)
            axes.set_xlabel("radial clearance, µm")
        grid[0].set_ylabel("shift of the resting tip, mm")
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside lower center", ncols=6)


def _switch(axes: Axes, switch: float) -> None:
    axes.axvline(1e6 * switch, color=INK, linewidth=1.0, linestyle="--")
    axes.text(1.1e6 * switch, 0.97, "ideal below", transform=axes.get_xaxis_transform(), va="top", fontsize=11, color=INK)
    axes.set_xlim(left=0.4e6 * switch)
    axes.set_xticks(np.geomspace(1.0, 1000.0, 4), ["1", "10", "100", "1000"])
