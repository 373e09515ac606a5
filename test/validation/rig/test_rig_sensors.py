"""The sensor model's statistics."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("exudyn")

from boom_twin.validation.rig.sensors import read, specific_force


@pytest.mark.parametrize(
    ("sigma", "resolution"),
    [(2e-5, 5e-6), (math.radians(0.01), math.radians(0.005))],
)
def test_noise_and_rounding(sigma, resolution):
    true = np.full((20_000, 2), 0.123456)
    values = read(true, sigma, resolution, np.random.default_rng(5))
    steps = values / resolution
    assert np.abs(steps - np.rint(steps)).max() < 1e-6
    expected = math.sqrt(sigma**2 + resolution**2 / 12)
    assert (values - true).std(axis=0) == pytest.approx(expected, rel=0.03)
    assert np.abs((values - true).mean(axis=0)).max() < 4 * expected / math.sqrt(20_000)


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_imu_reads_gravity_upwards_and_outward_acceleration_along_x(angle):
    force = specific_force(np.zeros((1, 2)), np.array([angle]), (0.0, -9.81))[0]
    assert force == pytest.approx([9.81 * math.sin(angle), 9.81 * math.cos(angle)])
    outward = np.array([[math.cos(angle), math.sin(angle)]])
    assert specific_force(outward, np.array([angle]), (0.0, 0.0))[0] == pytest.approx([1.0, 0.0], abs=1e-12)
