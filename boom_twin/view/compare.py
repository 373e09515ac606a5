"""Picture of two sessions: how far apart their figures are, in standard deviations."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .style import GREEN, GREY, ORANGE, picture

SHOWN = 30.0
"""Standard deviations at which a bar is cut off, with its number beside it."""


def compare_picture(path: Path, title: str, names: list[str], apart: list[float], sure: float, note: str = "") -> None:
    """Write it: a bar for every figure.

    Parameters
    ----------
    path : Path
    title : str
    names : list of str
        Of the figures.
    apart : list of float
        B minus A, over the standard deviation of that.
    sure : float
        From where on a difference is no chance.
    note : str
    """
    with picture(path, title, note, (16.0, 2.0 + 0.42 * max(len(names), 1))) as figure:
        axes = figure.add_subplot()
        places = np.arange(len(names))
        axes.axvspan(-sure, sure, color=GREEN, alpha=0.12, linewidth=0, label="may be chance")
        colours = [ORANGE if abs(value) > sure else GREY for value in apart]
        axes.barh(places, np.clip(apart, -SHOWN, SHOWN), height=0.7, color=colours)
        for place, value in zip(places, apart, strict=True):
            if abs(value) > SHOWN:
                side = "left" if value > 0.0 else "right"
                axes.annotate(f"{value:+.0f}", (np.sign(value) * SHOWN, place), va="center", ha=side)
        axes.set_yticks(places, names)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlim(-SHOWN - 4.0, SHOWN + 4.0)
        axes.grid(axis="y", visible=False)
        axes.set_xlabel("B minus A, standard deviations")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1)
