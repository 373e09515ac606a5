"""Statics, frequencies and motion of the default scene (surrogate parameters) against the reference numbers."""

from __future__ import annotations

import pytest
from analysis.reference_errors import AT_REST, MOVING, POSTURES, at_rest, moving


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("by_strokes", [False, True], ids=["posture", "strokes"])
def test_statics(posture, by_strokes):
    errors = at_rest(posture, by_strokes)
    assert {name: value for name, value in errors.items() if not value < AT_REST[name]} == {}


def test_a_move() -> None:
    errors = moving()
    assert {name: value for name, value in errors.items() if not value < MOVING[name]} == {}
