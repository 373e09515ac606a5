"""Picture of the study of round-off."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from boom_twin.plots.style import BLUE, GREY, INK, ORANGE, SKY, picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def roundoff_picture(
    path: Path,
    title: str,
    steps: np.ndarray,
    errors: np.ndarray,
    target: float,
    counts: np.ndarray,
    digits: dict[str, np.ndarray],
    note: str = "",
) -> None:
    """Write two panels: `errors` of the tip over `steps` (s); `digits` lost by each way of solving over `counts` sections."""
    with picture(path, title, note, (16.0, 7.0)) as figure:
        left, right = figure.subplots(1, 2)
        _errors(left, steps, errors, target)
        _digits(right, counts, digits)


def _errors(axes: Axes, steps: np.ndarray, errors: np.ndarray, target: float) -> None:
    axes.loglog(steps, errors, "o-", color=BLUE, label="default method")
    square = errors[0] * (steps / steps[0]) ** 2
    shown = square >= 0.3 * errors.min()
    axes.loglog(steps[shown], square[shown], "--", color=GREY, label="falls with the square of the step")
    axes.axhline(target, color=ORANGE, linewidth=1.0, label=f"above {target:.0e} it may not turn up")
    axes.set_xlabel("step, s")
    axes.set_ylabel("largest error of the tip / length of the boom")
    axes.set_title("error over the step: where round-off takes over")
    axes.legend(loc="lower right")


def _digits(axes: Axes, counts: np.ndarray, digits: dict[str, np.ndarray]) -> None:
    looks = zip(digits.items(), ((BLUE, "o-"), (ORANGE, "s-"), (SKY, "^--"), (INK, "v--")), strict=False)
    for (name, lost), (colour, line) in looks:
        axes.semilogx(counts, lost, line, color=colour, label=name)
    axes.axhline(16.0, color=GREY, linewidth=0.8)
    axes.text(counts[0], 15.6, "all of them", color=GREY, va="top", fontsize=11)
    axes.set_ylim(-0.5, 17.0)
    axes.set_xticks(counts, [f"{count:.0f}" for count in counts])
    axes.set_xticks([], minor=True)
    axes.set_xlim(0.9 * float(np.min(counts)), 1.1 * float(np.max(counts)))
    axes.set_xlabel("sections of a boom of 20 m")
    axes.set_ylabel("decimal digits lost in one Newton pass, of 16")
    axes.set_title("digits lost over the length of the chain, step 1 ms")
    axes.legend(loc="center right")
