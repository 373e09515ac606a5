"""The bundled moves on other booms, and bounds and list of the faults."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from boom_twin import load_scene
from boom_twin.errors import UsageError
from boom_twin.scene.kinematics import stroke_range
from boom_twin.validation.rig import faults
from boom_twin.validation.rig.motion import BUNDLED_DURATION, BUNDLED_MOVES, SAMPLES, TIP_SPEED, bundled, tip_speed

SCENE = load_scene()


def test_the_default_boom_makes_the_very_moves() -> None:
    assert bundled(SCENE).moves == BUNDLED_MOVES
    assert bundled(SCENE.with_(payload=30)).moves == BUNDLED_MOVES


@pytest.mark.parametrize("sections", [1, 2, 3])
def test_another_boom_makes_moves_within_its_own_ranges(sections: int) -> None:
    postures = {"low": SCENE.postures["arch"][:sections]}
    scene = SCENE.model_copy(
        update={"sections": SCENE.sections[:sections], "joints": SCENE.joints[:sections], "postures": postures}
    )
    times = np.linspace(0.0, BUNDLED_DURATION, 401)
    programme = bundled(scene)
    strokes, _ = programme(times)
    for i in range(sections):
        low, high = stroke_range(scene, i, SAMPLES)
        assert low <= strokes[:, i].min() < strokes[:, i].max() <= high
        assert np.ptp(strokes[:, i]) > 0.04 * (high - low)
    assert tip_speed(scene, programme, times).max() <= TIP_SPEED


def test_a_boom_without_postures_is_told_so() -> None:
    with pytest.raises(UsageError, match="no posture to start from"):
        bundled(SCENE.model_copy(update={"postures": {}}))


@pytest.mark.parametrize(
    "text",
    [
        "tip.payload:more:1e6",
        "line_fill:more:1e4",
        "tip.payload:less:20",
        "joint_2.sensor:bias:90",
        "cylinder_1.sensor:spikes:-20",
        "joint_1.sensor:noisy:1e9",
        "joint_angles.delay:late:3600",
        "cylinder_2.sensor:scale:-5",
    ],
)
def test_a_fault_beyond_what_a_rig_can_have_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match=r"size = .*, must be at most .* on this boom"):
        faults.check([faults.parse(text)], SCENE, 60.0)


def test_the_list_names_every_cause_and_kind() -> None:
    text = "\n".join(faults.listing())
    for cause in ("cylinder_I.k", "section_I.EI", "tip.payload", "joint_angles.delay", "cylinder_I.rod.clearance"):
        assert f"\n{cause} " in text
    assert all(f" {kind} " in text for kind in ("softer", "more", "less", "bias", "dropout", "late", "missing"))
    assert "\\" not in text and max(map(len, text.splitlines())) < 130
