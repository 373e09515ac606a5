"""The spectrum against scipy and known signals: frequencies of sines, damping of shaken oscillators."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from scipy.signal import lfilter, welch

from boom_twin import frequency_response, load_scene
from boom_twin.analysis.posture_modes import ModeList
from boom_twin.monitor.data.analyst import RESPONSE_FREQUENCIES, ResponseList
from boom_twin.monitor.data.spectrum import FREQUENCIES, SEGMENT, spectrogram, spectrum

RATE = 200.0
TIMES = np.arange(int(40 * RATE)) / RATE


def test_the_density_is_scipys_and_the_spectrogram_the_parts_it_is_the_mean_of() -> None:
    values = np.random.default_rng(4).normal(size=(len(TIMES), 2)) + np.sin(2.0 * np.pi * 3.0 * TIMES)[:, None]
    found = spectrum(TIMES, values)
    assert found is not None
    frequencies, densities = welch(values, RATE, "hann", round(SEGMENT * RATE), detrend="constant", axis=0)
    assert found.frequencies == pytest.approx(frequencies)
    assert found.densities[1:] == pytest.approx(densities[1:], rel=1e-6)
    parts = spectrogram(TIMES, values, np.arange(SEGMENT, TIMES[-1] + 0.1, 0.5 * SEGMENT) - 1.0 / RATE)
    assert parts.mean(axis=0)[1:] == pytest.approx(densities.sum(axis=1)[1 : len(FREQUENCIES)], rel=1e-4)
    assert FREQUENCIES[np.argmax(parts[0])] == 3.0
    assert spectrum(TIMES[:1000], values[:1000]) is None and spectrum(TIMES[:0], values[:0]) is None


@pytest.mark.parametrize("frequency", [0.97, 2.3, 11.1])
def test_a_sine_is_a_peak_at_its_frequency_with_its_power(frequency: float) -> None:
    noise = np.random.default_rng(2).normal(0.0, 0.01, (len(TIMES), 2))
    found = spectrum(TIMES, noise + np.outer(np.sin(2 * np.pi * frequency * TIMES), (1.0, 0.0)))
    assert found is not None
    highest = max(found.peaks, key=lambda peak: peak.density)
    assert highest.frequency == pytest.approx(frequency, abs=0.02)
    assert found.densities[:, 0].sum() * found.frequencies[1] == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(("frequency", "damping"), [(1.06, 0.02), (2.3, 0.03), (5.4, 0.01)])
def test_the_damping_of_a_shaken_oscillator_is_found(frequency: float, damping: float) -> None:
    found = []
    for seed in range(12):
        pole = 2 * np.pi * frequency / RATE * (-damping + 1j * np.sqrt(1 - damping**2))
        push = np.random.default_rng(seed).normal(size=len(TIMES))
        values = lfilter([1.0], [1.0, -2.0 * np.exp(pole).real, abs(np.exp(pole)) ** 2], push)
        spectra = spectrum(TIMES, np.stack([values, 0.5 * values], axis=1))
        assert spectra is not None
        found.append(max(spectra.peaks, key=lambda peak: peak.density))
    assert np.median([peak.frequency for peak in found]) == pytest.approx(frequency, rel=0.02)
    assert np.nanmedian([peak.damping for peak in found]) == pytest.approx(damping, rel=0.4)


def test_missing_rows_uneven_times_and_slow_rates_do_no_harm() -> None:
    random = np.random.default_rng(3)
    times = TIMES + random.uniform(-2e-4, 2e-4, len(TIMES))
    values = np.stack([np.sin(2 * np.pi * 2.3 * times)] * 2, axis=1)
    values[500:520] = np.nan
    found = spectrum(times, values)
    assert found is not None and found.peaks[0].frequency == pytest.approx(2.3, abs=0.01)
    times = np.arange(0.0, 30.0, 1.0 / 20.0)
    times = times[(times < 10.0) | (times > 12.0)]
    parts = spectrogram(times, random.normal(size=(len(times), 2)), np.array([9.0, 33.0]))
    assert np.isfinite(parts[0][FREQUENCIES < 10.0]).all() and np.isnan(parts[0][FREQUENCIES > 10.0]).all()
    assert np.isnan(parts[1]).all()


def test_modes_and_responses_follow_the_posture() -> None:
    """The response as `frequency_response` gives it for 1 N, and for 1 mm of a drive."""
    scene = load_scene()
    modes, responses, strokes = ModeList(scene), ResponseList(scene), strokes_of_posture(scene, "arch")
    natural, first = modes.at(strokes), responses.at(strokes)
    assert natural == pytest.approx([1.0618, 2.3006, 5.3833, 11.0895, 41.996, 47.265], rel=1e-3)
    assert first.loads == ("1 N at the tip, up", *(f"1 mm of cylinder {i}" for i in range(1, 5))) and not first.trouble
    by_force = frequency_response(scene, RESPONSE_FREQUENCIES, strokes=strokes).tip_acceleration
    by_drive = frequency_response(scene, RESPONSE_FREQUENCIES, strokes=strokes, drive=3).tip_acceleration
    assert first.accelerations[:, 0] == pytest.approx(np.linalg.norm(by_force, axis=1), rel=1e-9)
    assert first.accelerations[:, 3] == pytest.approx(1e-3 * np.linalg.norm(by_drive, axis=1), rel=1e-9)
    assert responses.at(strokes + 0.001) is first and modes.at(strokes + 0.001) is natural
    assert not np.allclose(responses.at(strokes + 0.02).accelerations, first.accelerations, rtol=1e-3)
    assert modes.at(strokes + 0.02) != natural
    found = ResponseList(scene).at([9.0, 0.5, 0.5, 0.5])
    assert found.loads == () and "stroke_1 = 9 m" in found.trouble
