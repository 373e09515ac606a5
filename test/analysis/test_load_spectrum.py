"""Main frequency of the load at the tip against closed forms: right within its deviation, and none where there is none."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.analysis.load_spectrum import LEAST, TipLoad, TipLoadFinder, find_pulses

RATE = 200.0
UP = np.array([0.0, 1.0])


def times(seconds: float, rate: float = RATE) -> np.ndarray:
    """Stamps (k,) in s with the jitter of a sensor."""
    count = round(seconds * rate)
    return np.arange(count) / rate + np.random.default_rng(1).uniform(-2e-4, 2e-4, count)


def pulses(t: np.ndarray, frequency: float, height: float) -> np.ndarray:
    """Rectangular pulses, upward, on for half of every period; shape (k, 2)."""
    return height * ((t * frequency) % 1.0 < 0.5)[:, None] * UP


def tip_load(t: np.ndarray, loads: np.ndarray, variances: np.ndarray) -> TipLoad | None:
    """Load in estimates (k, 2) in N with their variances at `t` (k,) in s."""
    finder = TipLoadFinder()
    finder.add(np.round(t / 1e-9).astype(np.int64), loads, variances)
    return finder.load


def known_load(t: np.ndarray, loads: np.ndarray) -> TipLoad | None:
    """Load in estimates that are 1 N uncertain."""
    return tip_load(t, loads, np.full(loads.shape, 0.5))


@pytest.mark.parametrize("frequency", [0.2, 0.43, 0.6])
@pytest.mark.parametrize(("seconds", "rate"), [(40.0, 200.0), (60.0, 50.0), (24.0, 1000.0)])
def test_rectangular_pulses_give_their_frequency_and_height(frequency: float, seconds: float, rate: float) -> None:
    t = times(seconds, rate)
    found = known_load(t, pulses(t, frequency, 130.0) + 25.0)
    assert found is not None and found.pulses is not None
    assert found.pulses.frequency == pytest.approx(frequency, rel=0.02)
    assert found.pulses.height == pytest.approx(130.0, rel=0.05)
    assert found.text.startswith(f"pulses of {found.pulses.height:.0f} N (+- {found.pulses.height_sigma:.0f}) at ")


def test_a_sine_in_any_direction_gives_its_fundamental() -> None:
    t = times(60.0)
    found = known_load(t, 50.0 * np.sin(2.0 * np.pi * 0.37 * t)[:, None] * np.array([0.6, -0.8]))
    assert found is not None and found.pulses is not None
    assert found.pulses.frequency == pytest.approx(0.37, rel=0.002)
    assert found.pulses.height == pytest.approx(0.5 * np.pi * 50.0, rel=0.01)
    assert found.rms == pytest.approx(50.0 / np.sqrt(2.0), rel=0.02)


def test_the_stated_deviations_are_true_in_white_noise() -> None:
    chance, off = np.random.default_rng(3), []
    t = np.arange(800) * 0.05
    for _ in range(200):
        wave = 40.0 * np.sin(2.0 * np.pi * 0.43 * t + chance.uniform(0.0, 6.3))[:, None] * UP
        found = find_pulses(wave + 30.0 * chance.standard_normal((800, 2)), 0.05)
        assert found is not None
        off.append(((found.frequency - 0.43) / found.frequency_sigma, (found.height - 20.0 * np.pi) / found.height_sigma))
    assert np.std(off, axis=0) == pytest.approx(1.0, abs=0.2) and np.abs(np.mean(off, axis=0)).max() < 0.3


def test_noise_without_a_period_has_no_main_frequency() -> None:
    chance, kept = np.random.default_rng(4), np.exp(-0.05)
    for scale in (1.0, 100.0):
        gusts = np.zeros((800, 2))
        for row in range(1, 800):
            gusts[row] = kept * gusts[row - 1] + scale * np.sqrt(1.0 - kept**2) * chance.standard_normal(2)
        found = known_load(np.arange(800) * 0.05, gusts)
        assert found is not None and found.pulses is None
        told = "none above 20 N after the start" if scale == 1.0 else f"{found.rms:.0f} N rms (+- 1), no main frequency"
        assert found.text == told


def test_a_small_load_is_none_and_what_was_never_measured_is_not_told() -> None:
    t = times(40.0)
    small = known_load(t, pulses(t, 0.43, 0.5 * LEAST))
    assert small is not None and small.text == "none above 20 N after the start"
    assert known_load(t, np.zeros((len(t), 2))) is None
    assert known_load(t[:0], np.zeros((0, 2))) is None


@pytest.mark.parametrize(("sigma", "told"), [(10.0, "pulses of 130 N (+- 14) at"), (60.0, "none above 235 N after the start")])
def test_pulses_within_the_uncertainty_of_the_estimate_are_not_told_from_none(sigma: float, told: str) -> None:
    t = times(40.0)
    found = tip_load(t, pulses(t, 0.43, 130.0) - 65.0 * UP, np.full((len(t), 2), sigma**2))
    assert found is not None and found.text.startswith(told) and found.is_there == ("pulses" in told)


@pytest.mark.parametrize(
    ("sigma", "told"), [(10.0, "85 N rms (+- 14), no main frequency"), (60.0, "none above 255 N after the start")]
)
def test_a_load_within_its_uncertainty_is_not_told_from_none(sigma: float, told: str) -> None:
    t = times(5.0)
    found = tip_load(t, np.full((len(t), 2), 60.0), np.full((len(t), 2), sigma**2))
    assert found is not None and found.text == told and found.is_there == ("rms" in told)


def test_a_load_above_none_is_within_the_bound_that_is_told() -> None:
    """Estimates are means given the readings: the load itself has their variance besides, here twice their own."""
    t, chance = times(40.0), np.random.default_rng(6)
    estimated = pulses(t, 0.43, 130.0) - 65.0 * UP
    found = tip_load(t, estimated, np.full((len(t), 2), 65.0**2))
    load = estimated + 65.0 * chance.standard_normal((len(t), 2))
    assert found is not None and found.text == f"none above {found.bound:.0f} N after the start"
    assert np.quantile(np.hypot(*load.T), 0.95) < found.bound
