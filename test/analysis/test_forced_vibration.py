"""Natural frequencies while a pump or the wind shakes the boom: true error over stated deviation, on closed forms."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
import pytest
from analysis.shaken_boom import record

from boom_twin.analysis.forced_vibration import forced_vibrations
from boom_twin.analysis.free_vibration import Vibration
from boom_twin.health.inference.holds import PASSED, SURE_SHAKEN, is_clear, strongest_motion


def run(search: Generator[None, None, list[Vibration]]) -> list[Vibration]:
    """What a search finds, and that it lets others work meanwhile."""
    for parts in range(2000):
        try:
            next(search)
        except StopIteration as end:
            assert parts > 100
            return end.value
    raise AssertionError("no end")


def found_in(seed: int) -> tuple[np.ndarray, list[Vibration]]:
    """True frequencies that guesses 2 % off are made of, and what is found."""
    frequencies, times, imu = record(seed)
    thin = imu[: len(imu) // 5 * 5].reshape(-1, 5, 2).mean(axis=1)
    dt, samples = strongest_motion(5.0 * times[1], thin)
    guesses = frequencies * (1.0 + 0.02 * np.random.default_rng([seed, 5]).normal(size=3))
    inside = guesses < PASSED * 0.5 / dt
    return frequencies[inside], run(forced_vibrations(dt, samples, guesses[inside]))


def scores(seeds: range) -> np.ndarray:
    """Error over stated deviation, and that over the frequency, of all that a hold takes; shape (k, 2)."""
    rows = []
    for seed in seeds:
        true, found = found_in(seed)
        rows += [
            ((each.frequency - own) / each.frequency_sigma, each.frequency_sigma / own)
            for each, own in zip(found, true, strict=False)
            if is_clear(each, SURE_SHAKEN)
        ]
    return np.array(rows)


@pytest.mark.parametrize("kind", [0, 1, 2], ids=["pump", "wind", "both"])
def test_frequencies_of_a_shaken_boom_are_as_sure_as_stated(kind: int) -> None:
    rows = scores(range(kind, 36, 3))
    assert len(rows) >= 4 and np.abs(rows[:, 0]).max() < 4.0
    assert (rows[:, 0] ** 2).mean() < 1.0 + 3.0 * np.sqrt(2.0 / len(rows)), "chi-square: three deviations of its mean"
    assert np.median(rows[:, 1]) < 0.01


def test_noise_alone_gives_no_frequency_that_is_sure() -> None:
    samples = np.random.default_rng(3).normal(size=125)
    assert all(
        each.frequency_sigma > 0.02 * each.frequency for each in run(forced_vibrations(0.075, samples, np.array([1.0, 2.4])))
    )


def test_a_pump_alone_gives_no_frequency_that_is_sure() -> None:
    """Its lines may have any size: one at a natural frequency is none."""
    times = 0.075 * np.arange(125.0)
    lines = sum(np.cos(2.0 * np.pi * 0.34 * h * times + h) / h for h in (1, 3, 5, 7, 9, 11, 13))
    samples = lines + 0.02 * np.random.default_rng(4).normal(size=125)
    assert all(
        each.frequency_sigma > 0.02 * each.frequency for each in run(forced_vibrations(0.075, samples, np.array([1.0, 2.4])))
    )
