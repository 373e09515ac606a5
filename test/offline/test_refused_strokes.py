"""What is said of the first stroke that could not be used: its likely unit, or that cylinders are swapped."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from default_boom import strokes_of_posture

from boom_twin import BoomTwinError, Sample, Stream, load_scene, replay
from boom_twin.offline.refused_strokes import RefusedStrokes
from boom_twin.twin.blocks import block_of

TRAVEL = np.array([joint.cylinder.max_stroke for joint in load_scene().joints])


def told(strokes: np.ndarray) -> str:
    refused = RefusedStrokes(load_scene())
    refused.take(block_of([Sample(Stream.STROKES, 1, strokes)], 4))
    return refused.told


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e3), ("cm", 1e2)])
def test_strokes_in_another_unit(unit: str, factor: float) -> None:
    assert f"With the unit `{unit}` it would fit: give by --mapping" in told(0.9 * factor * TRAVEL)


@pytest.mark.parametrize(("unit", "factor"), [("m", 1.0), ("mm", 1e3)])
def test_lengths_from_pin_to_pin(unit: str, factor: float) -> None:
    closed = np.array([joint.cylinder.closed_length for joint in load_scene().joints])
    said = told(factor * (closed + 0.5 * TRAVEL))
    assert "lengths from pin to pin: take closed_length off" in said
    assert f"cylinder_1: {{unit: {unit}, zero: {factor * closed[0]:g}}}" in said


def test_swapped_strokes_are_no_other_unit() -> None:
    assert strokes_of_posture(load_scene(), "arch").max() < TRAVEL.max()
    said = told(np.array(0.9 * TRAVEL)[::-1])
    assert "In another order the strokes would fit: look for cylinders whose names or columns are swapped" in said
    assert "unit" not in said


def test_with_the_default_scene_another_boom_is_likelier_than_inches() -> None:
    """The session named no scene; a stroke a little beyond the travel was told to be in inches."""
    near, far = RefusedStrokes(load_scene(), "default scene"), RefusedStrokes(load_scene(), "default scene")
    for refused, first in ((near, 0.906), (far, 630.0)):
        refused.take(block_of([Sample(Stream.STROKES, 1, np.array([first, 0.6, 0.2, 0.2]))], 4))
    assert "for another boom give --scene" in near.told and "unit" not in near.told
    assert "--scene" not in far.told


def test_the_most_frequent_event_is_named_and_not_its_consequence(tmp_path: Path) -> None:
    """Every stroke was in mm and a tenth was missing; the message said that most were missing."""
    strokes = 1e3 * strokes_of_posture(load_scene(), "arch")
    table = {"t_s": 0.01 * np.arange(100)} | {f"cylinder_{i + 1}": np.full(100, stroke) for i, stroke in enumerate(strokes)}
    table["cylinder_3"][::10] = np.nan
    with pytest.raises(BoomTwinError, match="Most often out of range: a stroke outside 0 to max_stroke"):
        replay(table, None, tmp_path / "out")
