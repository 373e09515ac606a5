"""Natural frequencies of free vibration: true error over stated deviation, on closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.analysis.free_vibration import free_vibrations

DT, FREQUENCIES, DAMPINGS = 0.025, np.array([0.986, 2.64, 5.38]), np.array([0.008, 0.012, 0.02])
SHAPES = np.array([[1.0, 0.4], [0.5, -0.8], [0.3, 0.2]])


def record(noise: float, seed: int) -> np.ndarray:
    """Two channels of 10 s of three modes that decay, and white noise; shape (400, 2)."""
    rng, times = np.random.default_rng(seed), DT * np.arange(400.0)
    waves = [
        np.exp(-damping * 2.0 * np.pi * f * times) * np.cos(2.0 * np.pi * f * np.sqrt(1.0 - damping**2) * times + phase)
        for f, damping, phase in zip(FREQUENCIES, DAMPINGS, rng.uniform(0.0, 2.0 * np.pi, 3), strict=True)
    ]
    return np.array(waves).T @ SHAPES + rng.normal(0.0, noise, (400, 2))


@pytest.mark.parametrize("lags", [None, 80])
def test_errors_are_as_large_as_stated(lags: int | None) -> None:
    scores = []
    for seed in range(100):
        found = free_vibrations(DT, record(0.05, seed), lags)
        near = [min(found, key=lambda each: abs(each.frequency - frequency)) for frequency in FREQUENCIES]
        scores += [(each.frequency - true) / each.frequency_sigma for each, true in zip(near, FREQUENCIES, strict=True)]
    mean = np.square(scores).mean()
    assert abs(mean - 1.0) < 3.0 * np.sqrt(2.0 / len(scores)), "chi-square: three deviations of its mean"
