"""Studies of a scene's parts, their motions and their folders."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, motion_of
from oracle import booms
from oracle.conftest import random_scene

from boom_twin import Scene
from boom_twin.analysis.methods import TURN
from boom_twin.reduction import deviation
from boom_twin.reduction.search import variants
from boom_twin.validation.study import parts


@pytest.fixture(scope="module")
def found(two_sections: Scene) -> dict[str, Any]:
    return parts.measure(two_sections, deviation.course_of(two_sections), rounds=1)


def test_every_variant_is_there_ascending_in_error(found: dict[str, Any], two_sections: Scene) -> None:
    rows = found["variants"]
    assert {part["name"] for part in rows} == {variant.name for variant in variants(two_sections)}
    errors = [max(part["rest_error_m"], part["move_error_max_m"]) for part in rows]
    assert errors == sorted(errors) and all(np.isfinite(errors))
    assert all(part["status"] == "ok" and part["step_time_s"] > 0.0 for part in rows)


SCENES = [*(booms.random_boom(seed) for seed in range(10)), *(random_scene(seed) for seed in range(10))]


@pytest.mark.parametrize("scene", SCENES, ids=[f"booms{i}" for i in range(10)] + [f"scene{i}" for i in range(10)])
def test_motion_stays_inside(scene):
    motion = motion_of(scene)
    moved = np.flatnonzero(motion.travel)
    assert len(moved) and not np.any(moved % 2)
    strokes, _ = motion(np.linspace(0.0, motion.duration, 50))
    for i, joint in enumerate(scene.joints):
        assert strokes[0, i] == motion.first[i]
        assert strokes[:, i].min() >= -1e-9 and strokes[:, i].max() <= joint.cylinder.max_stroke + 1e-9
    turned = joint_angles_of_strokes(scene, strokes[-1], near=motion.angles) - motion.angles
    assert np.all(np.abs(turned[motion.travel == 0.0]) < 1e-7)
    halvings = np.log2(TURN / np.abs(turned[moved]))
    assert halvings == pytest.approx(np.round(halvings), abs=1e-4) and np.all(halvings < 3.5)
