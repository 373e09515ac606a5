"""Pictures of health: the words above the levels lie over no legend, however many channels there are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import boom_twin.plots.health as drawing


@pytest.mark.parametrize("channels", [4, 6, 10])
def test_title_and_legend_of_the_levels_are_apart(tmp_path: Path, figures_of: Callable[..., list[Any]], channels: int) -> None:
    figures = figures_of(drawing)
    names = tuple(f"cylinder_force_{i + 1}" for i in range(channels))
    stamps, levels = np.arange(10.0), np.full((10, channels), 0.1)
    drawing.timeline_picture(tmp_path / "timeline.png", "session", 10.0, [], stamps, names, levels, "synthetic")
    upper, lower = figures[0].axes
    title, legend = lower.title.get_window_extent(), lower.get_legend().get_window_extent()
    assert not title.overlaps(legend) and not title.overlaps(upper.get_window_extent())
    assert not legend.overlaps(upper.get_window_extent()) and title.x1 < figures[0].bbox.x1
