"""Pictures of the study of the papers."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boom_twin.plots.style import BLUE, GREY, ORANGE, picture


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
