"""Pictures of the study of the papers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boom_twin.plots.style import BLUE, GREY, INK, ORANGE, picture

LOOKS = {  # pins, program: colour, width, dashes
    ("ideal", "own"): (GREY, 2.4, "-"),
    ("ideal", "peer"): (INK, 1.0, "--"),
    ("worn", "own"): (ORANGE, 2.4, "-"),
    ("worn", "peer"): (BLUE, 1.0, "--"),
}


@dataclass(frozen=True)
class StopTrace:
    """Stop of the boom in one posture, m rows.

    Times (s), rise of the tip (mm), its vertical acceleration (m/s^2) and the force of cylinder 1 (kN), each (m,).
    """

    posture: str
    pins: str
    program: str
    times: np.ndarray
    rise: np.ndarray
    acceleration: np.ndarray
    force: np.ndarray


def posture_picture(path: Path, title: str, note: str, peer: str, traces: list[StopTrace]) -> None:
    """Write a column a posture; `peer` is the name of the independent program."""
    postures = list(dict.fromkeys(trace.posture for trace in traces))
    with picture(path, title, note, (5.0 * max(len(postures), 2), 11.0)) as figure:
        grid = figure.subplots(3, len(postures), squeeze=False, sharex=True)
        for column, posture in enumerate(postures):
            for trace in (own for own in traces if own.posture == posture):
                colour, width, dashes = LOOKS[trace.pins, trace.program]
                label = f"{trace.pins} pins, {'this model' if trace.program == 'own' else peer}"
                rows = (trace.rise, trace.acceleration, trace.force)
                for axes, values in zip(grid[:, column], rows, strict=True):
                    axes.plot(trace.times, values, color=colour, linewidth=width, linestyle=dashes, label=label)
            grid[0, column].set_title(posture)
            grid[2, column].set_xlabel("time, s")
        grid[0, 0].set_ylabel("rise of the tip, mm")
        grid[1, 0].set_ylabel("vertical acceleration, m/s²")
        grid[2, 0].set_ylabel("force of cylinder 1, kN")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)


@dataclass(frozen=True)
class LetGoTrace:
    """Motion of a boom let go from the undeflected posture.

    Name; times (s) and height over that posture (mm), shape (m,); that height at rest (mm).
    """

    name: str
    times: np.ndarray
    height: np.ndarray
    rest: float


def low_speed_picture(
    path: Path, title: str, note: str, speeds: np.ndarray, errors: np.ndarray, traces: list[LetGoTrace]
) -> None:
    """Write the tip of booms that are let go, and errors (m) of the low-speed form over the fastest tip (m/s), both (k,)."""
    with picture(path, title, note, (16.0, 6.8)) as figure:
        left, right = figure.subplots(1, 2)
        for trace, colour in zip(traces, (BLUE, ORANGE), strict=False):
            left.plot(trace.times, trace.height, color=colour, label=trace.name)
            left.axhline(trace.rest, color=colour, linewidth=0.8, linestyle=":")
        left.set_xlabel("time, s")
        left.set_ylabel("height of the tip over the undeflected posture, mm")
        left.legend(loc="best")
        right.loglog(speeds, 1e3 * errors, color=BLUE, marker="o", label="largest error of the tip")
        guide = 1e3 * errors[0] * (speeds / speeds[0]) ** 2
        right.loglog(speeds, guide, color=GREY, linestyle=":", label="square of the speed")
        right.set_xlabel("fastest tip, m/s")
        right.set_ylabel("error without Coriolis and centrifugal terms, mm")
        right.legend(loc="best")
        right.set_xlim(0.9 * float(np.min(speeds)), 1.1 * float(np.max(speeds)))
