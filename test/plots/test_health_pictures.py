"""Picture of the alarms of a session."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import boom_twin.plots.health as drawing
from boom_twin.plots import AlarmSpan


@pytest.mark.parametrize("count", [0, 1, 12])
def test_every_alarm_has_a_row_with_its_channel_and_label(
    tmp_path: Path, figures_of: Callable[..., list[Any]], count: int
) -> None:
    figures = figures_of(drawing)
    alarms = [AlarmSpan(f"joint_{i + 1}", 0.5 * i, 9.0, "deviation") for i in range(count)]
    drawing.timeline_picture(tmp_path / "timeline.png", "session", 10.0, alarms, "synthetic")
    (axes,) = figures[0].axes
    assert [label.get_text() for label in axes.get_yticklabels()] == [alarm.channel for alarm in alarms]
    assert [text.get_text() for text in axes.texts] == (["deviation"] * count or ["no alarm"])
    assert axes.get_xlim() == (0.0, 10.0)
