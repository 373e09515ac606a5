"""Strokes that hold are known by the mean of their readings; those that move are smoothed."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.calibration.sessions import BAND, smoothed
from boom_twin.calibration.stroke_holds import held
from boom_twin.scene.pump_pulses import ease

STEP, CORNER, SIGMA = 0.005, 3.85, 2e-5
TIMES = np.arange(0.0, 20.0, STEP)


def made(true, seed=1):
    """Strokes with their holds, how much noise they have, and the smoothed ones."""
    measured = true + SIGMA * np.random.default_rng(seed).standard_normal(true.shape)
    found = smoothed(measured, STEP, CORNER)
    deviation = SIGMA * np.sqrt(STEP * BAND * CORNER)
    return *held(found, deviation, STEP), found


def test_a_hold_is_its_mean_and_a_move_is_smoothed():
    true = np.column_stack([0.5 + 0.1 * ease((TIMES - 8.0) / 3.0), np.full(len(TIMES), 0.3)])
    strokes, moving, found = made(true)
    at_rest, in_move = (TIMES < 7.0) | (TIMES > 12.0), (TIMES > 8.0) & (TIMES < 11.0)
    assert not moving[at_rest, 0].any()
    assert not moving[:, 1].any()
    np.testing.assert_array_equal(strokes[in_move, 0], found[in_move, 0])
    assert np.abs(strokes[at_rest] - true[at_rest]).max() < 2e-6
    assert np.std(found[at_rest] - true[at_rest]) > 3e-6
    assert np.abs(np.diff(strokes, n=2, axis=0)).max() < 1.2 * np.abs(np.diff(found, n=2, axis=0)).max()


@pytest.mark.parametrize("speed", [2e-6, 1e-5, 1e-3])
def test_a_stroke_that_creeps_is_held_no_worse_than_it_is_smoothed(speed):
    true = (0.5 + speed * TIMES)[:, None]
    strokes, _, found = made(true)
    assert np.std(strokes - true) < max(3.0 * np.std(found - true), 1.2e-5)


def test_a_short_stretch_is_all_smoothed():
    true = np.full((60, 1), 0.5)
    strokes, moving, found = made(true)
    np.testing.assert_array_equal(strokes, found)
    assert moving.all()
