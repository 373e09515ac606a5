"""Statics, frequencies and motion of the default scene (surrogate parameters) against the reference numbers."""

from __future__ import annotations

import numpy as np
import pytest
from analysis.reference_errors import AT_REST, MOVING, POSTURES, at_rest, moved


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("by_strokes", [False, True], ids=["posture", "strokes"])
def test_statics(posture, by_strokes):
    errors = at_rest(posture, by_strokes)
    assert {name: value for name, value in errors.items() if not value < AT_REST[name]} == {}


def test_a_move_and_that_its_velocity_is_the_slope_of_position() -> None:
    found, errors = moved()
    assert {name: value for name, value in errors.items() if not value < MOVING[name]} == {}
    slope = np.gradient(found.tip, found.times, axis=0)[1:-1]
    assert found.tip_velocity[1:-1] == pytest.approx(slope, abs=2e-3 * np.abs(slope).max())
