"""The spectrum of known signals: frequencies of sines and of a shaken oscillator."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from scipy.signal import lfilter

from boom_twin import load_scene
from boom_twin.analysis.posture_modes import ModeList
from boom_twin.monitor.data.analyst import spectrum

RATE = 200.0
TIMES = np.arange(int(40 * RATE)) / RATE


@pytest.mark.parametrize("frequency", [0.97, 2.3, 11.1])
def test_a_sine_is_a_peak_at_its_frequency_with_its_power(frequency: float) -> None:
    noise = np.random.default_rng(2).normal(0.0, 0.01, (len(TIMES), 2))
    found = spectrum(TIMES, noise + np.outer(np.sin(2 * np.pi * frequency * TIMES), (1.0, 0.0)))
    assert found is not None
    highest = max(found.peaks, key=lambda peak: peak["density"])
    assert highest["frequency"] == pytest.approx(frequency, abs=0.02)
    assert found.densities[:, 0].sum() * found.frequencies[1] == pytest.approx(0.5, rel=0.02)


def test_the_frequency_of_a_shaken_oscillator_is_found() -> None:
    found, frequency = [], 2.3
    for seed in range(12):
        pole = 2 * np.pi * frequency / RATE * (-0.03 + 1j)
        push = np.random.default_rng(seed).normal(size=len(TIMES))
        values = lfilter([1.0], [1.0, -2.0 * np.exp(pole).real, abs(np.exp(pole)) ** 2], push)
        spectra = spectrum(TIMES, np.stack([values, 0.5 * values], axis=1))
        assert spectra is not None
        found.append(max(spectra.peaks, key=lambda peak: peak["density"])["frequency"])
    assert np.median(found) == pytest.approx(frequency, rel=0.02)


def test_missing_rows_and_uneven_times_do_no_harm() -> None:
    random = np.random.default_rng(3)
    times = TIMES + random.uniform(-2e-4, 2e-4, len(TIMES))
    values = np.stack([np.sin(2 * np.pi * 2.3 * times)] * 2, axis=1)
    values[500:520] = np.nan
    found = spectrum(times, values)
    assert found is not None and found.peaks[0]["frequency"] == pytest.approx(2.3, abs=0.01)
    assert spectrum(times[:1000], values[:1000]) is None and spectrum(times[:0], values[:0]) is None


def test_modes_follow_the_posture() -> None:
    scene = load_scene()
    modes, strokes = ModeList(scene), strokes_of_posture(scene, "arch")
    natural = modes.at(strokes)
    assert natural == pytest.approx([1.0618, 2.3006, 5.3833, 11.0895, 41.996, 47.265], rel=1e-3)
    assert modes.at(strokes + 0.001) is natural
    assert modes.at(strokes + 0.02) != natural
    assert ModeList(scene).at([9.0, 0.5, 0.5, 0.5]) == []
