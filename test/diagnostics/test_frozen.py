"""The rule that tells a frozen sensor from a live one."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from boom_twin.config.settings import Settings, Thresholds
from boom_twin.health.sensor_check import readings_of_frozen


@pytest.mark.parametrize(("sigma", "resolution"), [(1.0, 0.25), (1.0, 0.5), (0.5, 1.0), (0.3, 1.0)])
def test_live_sensors_are_rarely_taken_for_frozen(sigma: float, resolution: float) -> None:
    """False alarms of 4 million readings of a still sensor, in the middle of a step, where it repeats most."""
    random, alarm, count = np.random.default_rng(1), 1e-4, 4_000_000
    needed = int(readings_of_frozen(sigma, resolution, alarm))
    readings = np.round(random.normal(0.0, sigma, count) / resolution)
    repeats = (readings[1:] == readings[:-1]).astype(np.int64)
    total = np.cumsum(repeats)
    runs = total[needed - 2 :] - np.concatenate([[0], total[: 1 - needed]]) if needed > 2 else repeats
    rate = np.count_nonzero(runs == needed - 1) / count
    assert 0.0 <= rate < alarm
    if sigma < resolution:  # one value is then by far the most frequent, and the bound is nearly reached
        assert rate > 0.2 * alarm


def test_numbers_that_are_stated() -> None:
    settings, alarm = Settings(), Thresholds().frozen_false_alarm
    needed = [
        readings_of_frozen(settings.stroke_sigma, settings.stroke_resolution, alarm),
        readings_of_frozen(settings.angle_sigma, settings.angle_resolution, alarm),
        readings_of_frozen(settings.imu_sigma, 0.0, alarm),
    ]
    assert needed == [10.0, 14.0, 2.0]
    assert readings_of_frozen(1.0, 7.0, 1e-9) == pytest.approx(4.4e4, rel=0.1)
    assert readings_of_frozen(1.0, 10.0, 1e-9) > 3e7


def test_a_sensor_without_noise_cannot_be_told() -> None:
    assert readings_of_frozen(0.0, 0.1, 1e-9) == readings_of_frozen(1e-3, 1.0, 1e-9) == inf
