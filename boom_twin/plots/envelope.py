"""Picture of a boom's envelope: the tip's places with its deflection there, ranges of all else, worst postures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.envelope import Envelope
from ..scene.kinematics import skeleton
from ..scene.schema import Scene
from ..types import Array
from .boom import draw_base
from .style import BLUE, GREEN, GREY, INK, ORANGE, PURPLE, SKY, picture, side_view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

COLOURS = {"kN": ORANGE, "Hz": GREEN, "kN m": PURPLE, "MPa": SKY}  # colours of bars, by unit
GAP = 16.0  # pixels between a bar, its words and the edge
LEAST_BAR_WIDTH = 0.1  # of the width, that is left for bars however long the words are


def envelope_picture(path: Path, scene: Scene, found: Envelope, ranges: list[tuple[str, Array]]) -> None:
    """Write the picture; `ranges` are words with unit, as in ``frequency 1, Hz``, and the values (m,) in that unit."""
    units = list(dict.fromkeys(words.rpartition(", ")[2] for words, _ in ranges))
    note = f"{len(found.names)} postures at rest"
    with picture(path, "Envelope over the working range", note, (18.0, 11.0)) as figure:
        grid = figure.add_gridspec(len(units) or 1, 2, width_ratios=[1.35, 1.0])
        _tips(figure.add_subplot(grid[:, 0]), scene, found)
        bars = []
        for row, unit in enumerate(units):
            own = [(words.rpartition(", ")[0], values) for words, values in ranges if words.rpartition(", ")[2] == unit]
            bars.append((axes := figure.add_subplot(grid[row, 1]), _bars(axes, found, own, unit)))
        figure.draw_without_rendering()
        for axes, labels in bars:
            _make_room(axes, labels)


def _tips(axes: Axes, scene: Scene, found: Envelope) -> None:
    side_view(axes)
    shown = axes.scatter(
        found.tips[:, 0], found.tips[:, 1], c=1e3 * found.deflections, s=26, cmap="viridis_r", zorder=3, label="tips"
    )
    axes.figure.colorbar(shown, ax=axes, label="tip deflection, mm", shrink=0.6, location="bottom", pad=0.02)
    worst = {"largest deflection": found.deflections.argmax()}
    if found.frequencies.shape[1]:
        worst["lowest frequency"] = found.frequencies[:, 0].argmin()
    if np.isfinite(found.stresses).any():
        worst["largest stress"] = np.nan_to_num(found.stresses).max(axis=1).argmax()
    names: dict[int, list[str]] = {}
    for name, row in worst.items():
        names.setdefault(int(row), []).append(name)
    for (place, of), colour in zip(names.items(), (INK, BLUE, ORANGE), strict=False):
        bones = skeleton(scene, np.diff(np.radians(found.angles[place]), prepend=0.0))
        label = f"{' and '.join(of)}: {found.posture(place)}"
        axes.plot(*bones.pivots.T, "o-", color=colour, linewidth=2.2, markersize=5, label=label)
    draw_base(axes, np.array(scene.base.pivot), 0.035 * scene.reach)
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=11)


def _bars(axes: Axes, found: Envelope, own: list[tuple[str, Array]], unit: str) -> list[Annotation]:
    """Draw one bar for each quantity from its least to its greatest value; the ends are labelled with value and posture."""
    labels = []
    for place, (_, values) in enumerate(own):
        low, high = int(values.argmin()), int(values.argmax())
        axes.barh(place, values[high] - values[low], left=values[low], height=0.5, color=COLOURS.get(unit, GREY), alpha=0.8)
        for row, side in ((low, "right"), (high, "left")):
            gap = -4 if side == "right" else 4
            label = axes.annotate(
                f"{float(f'{values[row]:.3g}'):g} {found.posture(row)}", (values[row], place), (gap, 0),
                textcoords="offset points", ha=side, va="center", fontsize=9, color=INK,
            )  # fmt: skip
            label.set_in_layout(False)  # it has its room within the axes
            labels.append(label)
    axes.set_yticks(range(len(own)), [words for words, _ in own])
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlabel(unit)
    return labels


def _make_room(axes: Axes, labels: list[Annotation]) -> None:
    """Set limits of x between which bars and labels, left and right of their ends, fit into the width of drawn axes."""
    width = axes.get_window_extent().width
    ends = np.array([label.xy[0] for label in labels])
    room = np.array([label.get_window_extent().width + GAP for label in labels])
    sides = np.array([-1.0 if label.get_horizontalalignment() == "right" else 1.0 for label in labels])
    span = float(np.ptp(ends)) or 1.0
    for share in np.linspace(1.0, LEAST_BAR_WIDTH, 50):  # of the width, for what the bars span
        reach = ends + sides * room * span / (share * width)
        if np.ptp(reach) <= span / share:
            break
    axes.set_xlim(reach.min(), reach.max())
    if ends.min() >= 0.0:  # there are no negative frequencies and stresses, only room for words
        axes.set_xticks([tick for tick in axes.get_xticks() if 0.0 <= tick <= reach.max()])
