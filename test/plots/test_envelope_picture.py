"""Picture of an envelope: words beside the bars fit into their axes, the legend covers no point, angles have no minus zero."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

import boom_twin.plots.envelope as drawing
from boom_twin import load_scene
from boom_twin.analysis.envelope import Envelope

COUNT = 40


def envelope_of(scene: Any) -> Envelope:
    """Made-up numbers as a boom of 28 m has them, one posture next to 0 degrees from below."""
    rng = np.random.default_rng(4)
    n = len(scene.sections)
    angles = rng.uniform(-400.0, 180.0, (COUNT, n))
    angles[0] = -0.03
    tips = rng.uniform(-15.0, 15.0, (COUNT, 2))
    forces = rng.uniform(-1430e3, 973e3, (COUNT, n)) * np.array([0.2, 1.0, 0.3, 0.1])
    stresses = rng.uniform(8e4, 1.7e8, (COUNT, n))
    frequencies = np.sort(rng.uniform(0.5, 6.0, (COUNT, 3)))
    deflections = rng.uniform(0.0, 1.4, COUNT)
    return Envelope(("",) * COUNT, angles, tips, deflections, forces, frequencies, stresses * 1e-3, stresses, {}, 0)


def test_words_fit_beside_their_bars_and_the_legend_covers_nothing(
    tmp_path: Path, figures_of: Callable[..., list[Any]]
) -> None:
    figures = figures_of(drawing)
    scene = load_scene()
    found = envelope_of(scene)
    ranges = [(f"cylinder {i + 1} force, kN", 1e-3 * found.forces[:, i]) for i in range(4)]
    ranges += [(f"section {i + 1} bending stress, MPa", 1e-6 * found.stresses[:, i]) for i in range(4)]
    drawing.envelope_picture(tmp_path / "envelope.png", scene, found, ranges)
    (figure,) = figures
    tips, *bars = [axes for axes in figure.axes if axes.get_ylabel() == "y up, m" or axes.get_xlabel() in ("kN", "MPa")]
    assert len(bars) == 2 and tips.get_legend().get_window_extent().y0 >= tips.get_window_extent().y1
    forces, stresses = (axes.get_xticks() for axes in bars)
    assert forces.min() < 0.0 and stresses.min() == 0.0, "stresses are not negative, so their axis begins at 0"
    for axes in bars:
        frame, labels = axes.get_window_extent(), [text for text in axes.texts if text.get_text()]
        assert len(labels) == 8 and not any("e+" in label.get_text() for label in labels)
        for label in labels:
            extent = label.get_window_extent()
            assert frame.x0 <= extent.x0 and extent.x1 <= frame.x1, label.get_text()


def test_an_angle_next_to_zero_has_no_minus() -> None:
    assert envelope_of(load_scene()).posture(0) == "0,0,0,0"


def test_a_posture_that_is_worst_in_two_ways_is_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the second line hides the first."""
    labels: list[str] = []
    plot = Axes.plot

    def kept(axes: Any, *args: Any, **options: Any) -> Any:
        labels.append(options.get("label", ""))
        return plot(axes, *args, **options)

    monkeypatch.setattr(Axes, "plot", kept)
    scene = load_scene()
    found = envelope_of(scene)
    found.frequencies[found.deflections.argmax(), 0] = 0.1
    drawing.envelope_picture(tmp_path / "envelope.png", scene, found, [])
    rows = found.deflections.argmax(), found.stresses.max(axis=1).argmax()
    words = [
        f"{of}: {found.posture(int(row))}"
        for of, row in zip(("largest deflection and lowest frequency", "largest stress"), rows, strict=True)
    ]
    assert [label for label in labels if ":" in label] == words
