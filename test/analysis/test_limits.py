"""What is left out is the limit of what is small or stiff."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from oracle import booms, segments

from boom_twin import statics


def rigid(spec, beams=True):
    """A copy of a scene's dicts with incompressible cylinders, and rigid sections, by `modes` or for want of beams."""
    spec = dict(spec, modes=0 if beams else 3)
    spec["joints"] = [dict(joint, cylinder=_without(joint["cylinder"], "k", "d")) for joint in spec["joints"]]
    if not beams:
        spec["sections"] = [_without(s, "beam", "head", "A", "I", "rho_A", "rho_I", "beta") for s in spec["sections"]]
    return spec


def _without(part, *keys):
    return {key: value for key, value in part.items() if key not in keys}


@pytest.mark.parametrize("beams", [True, False])
def test_rigid_boom_in_motion_is_the_rigid_kinematics(beams):
    """The tip follows the circles of the linkages through every stroke; its angles come from the oracle's geometry."""
    scene = booms.scene_of(rigid(booms.document(), beams))
    start = np.array([1.0, -0.7, -0.9, -0.9])
    travel = np.array([0.05, -0.06, 0.07, 0.04])
    model = segments.Segments(scene, 0)
    drive = motions.smooth_drive(model.lengths(start), travel, 0.4)
    rows = motions.follow(scene, drive, start, 2e-3, 200, 20)
    angles = start
    for row, time in zip(rows, np.linspace(0.0, 0.4, 11), strict=True):
        for _ in range(6):  # Newton on the oracle's rigid geometry, joint by joint
            slopes = [(model.lengths(angles + 1e-6)[i] - model.lengths(angles - 1e-6)[i]) / 2e-6 for i in range(4)]
            angles = angles + (drive(time)[0] - model.lengths(angles)) / np.array(slopes)
        headings = np.cumsum(angles)
        tip = [s.length * np.array([np.cos(h), np.sin(h)]) for s, h in zip(scene.sections, headings, strict=True)]
        assert row[:4] == pytest.approx(angles, abs=1e-9)
        assert row[8:10] == pytest.approx(np.sum(tip, axis=0), abs=1e-9)


def test_a_split_without_force_changes_nothing():
    """The barrel pin of a weightless section splits the beam or, on the head, does not: the beam bends alike."""
    pivots = []
    for c in ([-1.5, 0.15], [-0.22, 0.55]):
        spec = booms.document()
        spec |= {"sections": spec["sections"][:2], "joints": spec["joints"][:2], "postures": {"down": [0.0, -60.0]}}
        spec["joints"][1] = _without(spec["joints"][1], "mL", "mR") | {"C": c}
        spec["joints"][1]["cylinder"] = {"k": 3e7, "closed_length": 0.3, "max_stroke": 3.0}
        spec["sections"][1] = {"length": 3.3}
        found = statics(booms.scene_of(spec), posture="down", modes=0)
        pivots.append(found.outline[-2])
        assert np.linalg.norm(found.tip - pivots[-1]) == pytest.approx(3.3)
    assert pivots[0][1] < -2e-3  # it does sag
    assert pivots[0] == pytest.approx(pivots[1], abs=1e-9)
