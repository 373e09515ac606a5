"""Cylinder forces in another unit or of the other sign: told in these words, and the estimate does without them."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.health.blocks import BLOCK
from boom_twin.health.force_reading import ForceReading
from boom_twin.types import Alarm

from .stream_blocks import block_of

NAMES = tuple(f"cylinder_force_{i}" for i in range(1, 5))
EXPECTED = np.array([-58e3, 93e3, 24e3, 1.5e3])  # N, of the default boom in posture arch
LBF = 4.4482216152605
WRONG = {
    "in kN": 1e-3,
    "in daN": 0.1,
    "in lbf": 1.0 / LBF,
    "in N and stated as kN": 1e3,
    "positive in compression": -1.0,
    "in kN and positive in compression": -1e-3,
}


def told(forces: ForceReading, factor: np.ndarray | float, load: np.ndarray | float = 0.0, first: int = 0) -> list[Alarm]:
    """Every alarm that begins or ends in 6 s in which forces are read times `factor`, with noise."""
    rng, news = np.random.default_rng(first), []
    for k in range(first, first + 60):
        raw = (EXPECTED + load) * factor + rng.normal(0.0, 100.0, (20, 4)) * np.minimum(1.0, np.abs(factor))
        news += forces.take(block_of(forces, raw, EXPECTED, k), k * BLOCK, (k + 1) * BLOCK)
    return news


@pytest.mark.parametrize("reason", WRONG)
def test_what_is_the_matter_is_told(reason: str) -> None:
    """Of the three large forces; the fourth is not used either."""
    forces = ForceReading(NAMES)
    alarms = told(forces, WRONG[reason])
    assert [alarm.cause for alarm in alarms] == [f"{name}.sensor" for name in NAMES[:3]]
    assert all(f", as if {reason}: not used" in alarm.evidence and alarm.since < 3e9 for alarm in alarms)
    assert forces.masked.all()


def test_one_cylinder_of_the_other_sign_is_told_alone_until_it_reads_right() -> None:
    forces, wrong = ForceReading(NAMES), np.array([1.0, -1.0, 1.0, 1.0])
    (alarm,) = told(forces, wrong)
    assert alarm.cause == "cylinder_force_2.sensor" and "reads -93" in alarm.evidence and "has +93" in alarm.evidence
    assert forces.masked.tolist() == [False, True, False, False]
    (ended,) = told(forces, 1.0, first=60)
    assert ended.until is not None and not forces.masked.any() and forces.alarms == ()


@pytest.mark.parametrize("factor", [0.6, 0.9, 1.1, 1.7])
def test_scales_and_loads_are_no_units(factor: float) -> None:
    """Nor are 1000 N at the tip, which do more than hold the weight of the last sections."""
    by_load = 1000.0 * np.array([-25.0, 22.0, 18.0, 14.0])
    assert told(ForceReading(NAMES), factor) == [] == told(ForceReading(NAMES), 1.0, by_load)


def test_a_force_that_passes_zero_under_a_load_is_in_no_other_unit() -> None:
    """At a tenth of what it has been, a load may make it a fifth of that, or turn it, for seconds."""
    forces, near_zero = ForceReading(NAMES), np.array([-58e3, 9.3e3, 24e3, 1.5e3])
    assert told(forces, 1.0) == []
    for first, share in ((60, 1.0 / LBF), (120, -1.0), (180, 0.1)):
        raw = near_zero * [1.0, share, 1.0, 1.0]
        for k in range(first, first + 60):
            assert forces.take(block_of(forces, np.tile(raw, (20, 1)), near_zero, k), k * BLOCK, (k + 1) * BLOCK) == []


def test_a_factor_that_does_not_last_is_no_unit() -> None:
    forces = ForceReading(NAMES)
    for first in (0, 60):
        for k in range(first, first + 25):
            raw = np.tile(EXPECTED * [1.0, 1.0 / LBF, 1.0, 1.0], (20, 1))
            assert forces.take(block_of(forces, raw, EXPECTED, k), k * BLOCK, (k + 1) * BLOCK) == []
        assert told(forces, 1.0, first=first + 25) == []


def test_what_was_not_measured_tells_nothing() -> None:
    forces, nothing = ForceReading(NAMES), np.full((20, 4), np.nan)
    for readings in (nothing, np.zeros((0, 4))):
        assert forces.take(block_of(forces, readings, readings, 0), 0, 1) == []
    assert not forces.masked.any()
