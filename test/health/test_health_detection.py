"""The detector against its own stated rate of false alarms, and against shifts of a known size."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.health.detection import Detector, cusum_threshold
from boom_twin.health.deviation_sums import ALLOWANCE, CUT, WINDOW

BLOCK = 0.1


@pytest.mark.parametrize("run", [200.0, 1000.0, 5000.0])
def test_threshold_gives_the_run_length(run):
    """Page's test in 2000 chains at once, each until its first alarm."""
    rng, threshold = np.random.default_rng(int(run)), cusum_threshold(run)
    sums, alive, total = np.zeros(2000), np.ones(2000, dtype=bool), 0
    while alive.any():
        total += int(alive.sum())
        sums = np.maximum(0.0, sums + rng.normal(size=2000) - ALLOWANCE)
        alive &= sums < threshold
    assert total / 2000 == pytest.approx(run, rel=0.15)


def test_threshold_grows_with_the_run():
    assert cusum_threshold(1e4) < cusum_threshold(1e6) < cusum_threshold(1e8)


def test_false_alarms_are_as_rare_as_stated():
    """200 an hour stated: counted over a simulated hour, the whole detector gives no more, and not far fewer."""
    stated, channels = 200.0 / 3600.0, 6
    detector, rng, count = Detector(channels, BLOCK, stated), np.random.default_rng(3), 0
    blocks = round(3600.0 / BLOCK)
    for normal in rng.normal(size=(blocks, channels)):
        detector.take(normal)
        if detector.levels.max() >= 1.0:
            count += 1
            detector.reset()
    expected = stated * blocks * BLOCK
    assert 0.3 * expected < count < expected + 3.0 * np.sqrt(expected)


def test_a_lasting_deviation_is_found_in_its_time():
    """The sum grows by the shift less the allowance: threshold over that many blocks, within noise."""
    for sign in (1.0, -1.0):
        detector, rng = Detector(3, BLOCK, 0.03 / 86400.0), np.random.default_rng(5)
        for normal in rng.normal(size=(50, 3)):
            detector.take(normal)
        assert detector.levels.max() < 1.0
        blocks = 0
        while detector.levels.max() < 1.0:
            detector.take(rng.normal(size=3) + np.array([0.0, sign * 3.0, 0.0]))
            blocks += 1
        assert np.argmax(detector.levels) == 1
        assert blocks == pytest.approx(detector.threshold / (3.0 - ALLOWANCE), abs=5)
        assert detector.blocks_since(1) == pytest.approx(blocks, abs=4)


def test_a_single_outlier_is_none():
    detector = Detector(2, BLOCK, 0.03 / 86400.0)
    for k in range(50):
        detector.take(np.array([1e6 if k == 30 else 0.0, 0.0]))
        assert detector.levels.max() < 1.0
    assert detector.suspicion == 0.0, "and it is forgotten"
    detector.take(np.array([1e6, 0.0]))
    assert detector.levels[0] == pytest.approx((CUT - ALLOWANCE) / detector.threshold)


def test_more_spread_is_found_by_its_squares():
    detector, rng = Detector(2, BLOCK, 0.03 / 86400.0), np.random.default_rng(6)
    for sign in range(3 * WINDOW):
        detector.take(np.array([3.5 * (-1.0) ** sign, rng.normal()]))
    assert detector.levels[0] >= 1.0 > detector.levels[1]
    assert detector.levels[0] == pytest.approx(WINDOW * 3.5**2 / detector.limit)


def test_what_is_not_measured_says_nothing():
    detector = Detector(2, BLOCK, 1e-6)
    detector.take(np.array([3.0, 3.0]))
    before = detector.levels
    detector.take(np.array([np.nan, np.nan]))
    assert detector.levels == pytest.approx(before)


def test_reset_of_one_channel():
    detector = Detector(2, BLOCK, 0.03 / 86400.0)
    for _ in range(3 * WINDOW):
        detector.take(np.array([4.0, 4.0]))
    detector.reset(np.array([True, False]))
    assert detector.levels[0] == 0.0 and detector.levels[1] >= 1.0
    detector.reset()
    assert detector.levels.max() == 0.0 and detector.suspicion == 0.0
