"""The error of a session without any usable stroke: the first value, its bound, and how the strokes may be wired."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from default_boom import strokes_of_posture

from boom_twin import BoomTwinError, load_scene, replay

ARCH = strokes_of_posture(load_scene(), "arch")
CLOSED = np.array([joint.cylinder.closed_length for joint in load_scene().joints])
TRAVEL = np.array([joint.cylinder.max_stroke for joint in load_scene().joints])


@pytest.mark.parametrize(
    ("strokes", "told"),
    [
        (1e3 * ARCH, "cylinder_1, mm;.*cylinder_4, mm"),
        (1e2 * ARCH, "cylinder_1, cm"),
        (CLOSED + ARCH, "cylinder_1, m, zero 1.08;.*cylinder_4, m, zero 1.09"),
        (1e3 * (CLOSED + ARCH), "cylinder_1, mm, zero 1080;.*cylinder_4, mm, zero 1090"),
        (0.9 * TRAVEL[::-1], "cylinder_1 not as declared.*perhaps cylinder_4, m;.*perhaps cylinder_1, m"),
    ],
    ids=["mm", "cm", "pin to pin", "pin to pin, mm", "swapped"],
)
def test_the_error_tells_how_the_strokes_may_be_wired(strokes: np.ndarray, told: str, tmp_path: Path) -> None:
    """The most frequent event is named, not its consequence: a tenth is missing, and the rest is out of range."""
    table = {"t_s": 0.01 * np.arange(400)} | {f"cylinder_{i + 1}": np.full(400, stroke) for i, stroke in enumerate(strokes)}
    table["cylinder_3"][::10] = np.nan
    with pytest.raises(BoomTwinError) as error:
        replay(table, None, tmp_path / "out")
    assert "Most often out of range: a stroke outside 0 to max_stroke" in str(error.value)
    assert re.search(f"first refused value: .* its sensor can read .*Wiring: .*{told}.* proposes a mapping", str(error.value))
