"""Stabilisation diagram of identified poles."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..types import Array
from .style import BLUE, GREY, ORANGE, legend_above, picture


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
