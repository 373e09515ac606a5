"""A boom at rest moved by several schemes: the same motion, and an effort that adds up."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from boom_twin import load_scene
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.validation.rig import Move, Programme, Scheme, at_rest, move, simulate


def test_moving_again_and_otherwise():
    scene = load_scene()
    first = strokes_of_posture(scene, "arch")
    drive = Programme(tuple(first), (Move(0, 0.0, 0.3, first[0] + 0.02),))
    resting = at_rest(scene, first, 4)
    rows, effort = move(resting, drive, 0.4, 2e-3, 4e-3)
    fresh = simulate(scene, drive, 0.4, 2e-3, 4e-3, 4)
    again, _ = move(resting, drive, 0.4, 2e-3, 4e-3)
    for name, values in rows.items():
        assert np.array_equal(values, again[name]), name
        assert values == pytest.approx(fresh[name], rel=1e-9, abs=1e-9), name
    assert effort.seconds > 0.0 and effort.passes >= 200 and effort.tangents < 50
    anew, dearer = move(resting, drive, 0.4, 2e-3, 4e-3, Scheme(kept=0, tolerance=1e-3))
    assert anew["tip_y_m"] == pytest.approx(rows["tip_y_m"], abs=2e-6)
    assert dearer.tangents == dearer.passes >= 200
    lean, cheaper = move(resting, drive, 0.4, 2e-3, 4e-3, Scheme(kept=1, tolerance=3e-4))
    assert lean["tip_y_m"] == pytest.approx(rows["tip_y_m"], abs=1e-4)
    assert 200 <= cheaper.passes < 1.8 * 200 and effort.tangents < cheaper.tangents < cheaper.passes
