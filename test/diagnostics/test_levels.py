"""Levels with hysteresis in value and time; the status of one component."""

from __future__ import annotations

from math import inf, nan

import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import Bounds, Hysteresis

BOUNDS, SLOW = Bounds(warn=1.0, error=2.0), Thresholds(raise_after=2.0, clear_after=5.0, release=0.8)
AT_ONCE = Thresholds(raise_after=0.0, clear_after=0.0, release=0.8)
LOW = Bounds(warn=100.0, error=10.0, low=True)


@pytest.mark.parametrize(
    ("values", "expected", "bounds", "thresholds"),
    [
        ([0, 1.5, 0, 1.5, 0], "OOOOO", BOUNDS, SLOW),  # too short
        ([0, 1.5, 1.5, 1.5, 1.5], "OOWWW", BOUNDS, SLOW),
        ([0, 2.5, 2.5, 2.5, 1.7, 1.7], "OOEEEE", BOUNDS, SLOW),  # not below 0.8 of the limit
        ([0, 2.5, 2.5, 1.5, 1.5, 1.5, 1.5, 1.5], "OOEEEEEW", BOUNDS, SLOW),
        ([0, 1.5, 1.5, 0.9, 0.9, 0.9, 0.9, 0.9], "OOWWWWWW", BOUNDS, SLOW),
        ([0, 1.5, 1.5, 0, 0, 1.5, 0, 0, 0, 0, 0], "OOWWWWWWWWO", BOUNDS, SLOW),
        ([nan, nan, nan], "OOO", BOUNDS, SLOW),
        ([0, 1.5, 2.5, 0], "OWEO", BOUNDS, AT_ONCE),
        ([inf, 101.0, 99.0, 9.0, 11.0, 13.0, 120.0, 126.0], "OOWEEWWO", LOW, AT_ONCE),
    ],
)
def test_a_level_must_last(values: list[float], expected: str, bounds: Bounds, thresholds: Thresholds) -> None:
    """First letters of the levels at one value a second."""
    judge = Hysteresis()
    found = [judge.update(value, bounds, thresholds, float(now)) for now, value in enumerate(values)]
    assert "".join(level.name[0] for level in found) == expected
