"""Pictures of a calibration: residuals by channel before and after, and parameters with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..records import Array
from .residuals import SIGMA, running_mean
from .style import BLUE, GREY, ORANGE, SKY, picture


@dataclass(frozen=True)
class Interval:
    """A parameter as it is drawn: name, unit, value before, estimate and its interval, and whether it was taken over."""

    name: str
    unit: str
    before: float
    now: float
    low: float
    high: float
    told: bool


def residuals_picture(
    path: Path, title: str, note: str, names: Sequence[str], times: tuple[Array, Array], normalised: tuple[Array, Array]
) -> None:
    """Residuals over their expected deviation, before on the left and after on the right.

    Parameters
    ----------
    names : sequence of str
        c channels.
    times : pair of ndarray, shape (k,)
        s.
    normalised : pair of ndarray, shape (k, c)
        NaN where not measured.
    """
    with picture(path, title, note, (16.0, max(6.0, 1.2 + 1.5 * len(names)))) as figure:
        panels = figure.subplots(len(names), 2, squeeze=False, sharex="col")
        for column, (word, at, values) in enumerate(zip(("before", "after"), times, normalised, strict=True)):
            for row, name in enumerate(names):
                axes, known = panels[row, column], np.isfinite(values[:, row])
                stamps, shown = at[known], values[known, row]
                axes.axhspan(-3.0, 3.0, color=SKY, alpha=0.22, linewidth=0)
                if stamps.size:
                    order = np.argsort(stamps)
                    stamps, shown = stamps[order], shown[order]
                    axes.plot(stamps, shown, ".", color=BLUE, markersize=2.0, alpha=0.5, markeredgewidth=0)
                    axes.plot(stamps, running_mean(stamps, shown), color=ORANGE, linewidth=1.6)
                    axes.set_title(f"{word}: rms {np.sqrt(np.mean(shown**2)):.2f}", fontsize=11)
                axes.set_ylabel(f"{name} / {SIGMA}")
            panels[-1, column].set_xlabel("time of what was held out, s")


def parameters_picture(path: Path, title: str, note: str, intervals: Sequence[Interval]) -> None:
    """One row a parameter: before, estimate, 95 % interval; shares in percent of the value before."""
    groups = list(dict.fromkeys(interval.unit for interval in intervals))
    counts = [sum(interval.unit == unit for interval in intervals) for unit in groups]
    with picture(path, title, note, (12.0, 1.6 + 0.8 * len(groups) + 0.4 * sum(counts))) as figure:
        panels = figure.subplots(len(groups), 1, squeeze=False, height_ratios=[1 + count for count in counts])[:, 0]
        for axes, unit in zip(panels, groups, strict=True):
            members = [interval for interval in intervals if interval.unit == unit]
            for row, each in enumerate(members):
                colour = BLUE if each.told else GREY
                axes.plot([each.low, each.high], [row, row], color=colour, linewidth=3.0, solid_capstyle="butt")
                axes.plot(each.now, row, "o", color=colour, markersize=7)
                axes.plot(each.before, row, "x", color=ORANGE, markersize=9, markeredgewidth=2.0)
            axes.set_yticks(range(len(members)), [each.name for each in members])
            axes.set_ylim(len(members) - 0.4, -0.6)
            axes.set_xlabel(unit)
        legend = "cross: before; dot and bar: estimate, 95 % interval; grey: cannot be told, left as before"
        panels[0].set_title(legend, fontsize=11)
