"""Free vibration: frequency and damping are found, and as sure as is said."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from boom_twin import Sample, Stream, Twin, load_scene, simulate, statics
from boom_twin.offline.history import HistoryBuilder
from boom_twin.offline.recording import Recording
from boom_twin.report.vibration import CYCLE_SIGMA, RestFinder, course, still, vibrations
from boom_twin.scene.edit import with_parameters
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.types import SECOND, Array, StrokeReading

TIMES = np.arange(0.0, 5.0, 0.005)


def swing(frequency: float, damping: float, size: float, phase: float = 0.3) -> Array:
    rate = 2.0 * np.pi * frequency
    return size * np.exp(-damping * rate * TIMES) * np.cos(rate * np.sqrt(1.0 - damping**2) * TIMES + phase)


def measured(seed: int, noise: float = 0.05) -> Array:
    """Two modes in two channels."""
    random = np.random.default_rng(seed)
    first, second = swing(1.05, 0.008, 1.0), swing(2.4, 0.02, 0.3, 1.0)
    return np.stack([0.4 * first + second, first - 0.5 * second], axis=1) + random.normal(9.0, noise, (len(TIMES), 2))


def nearest(values: Array, frequency: float):
    return min(vibrations(TIMES, values), key=lambda each: abs(each.frequency - frequency))


def test_without_noise_it_is_exact() -> None:
    for frequency, damping in ((1.05, 0.008), (2.4, 0.02)):
        found = nearest(measured(0, 1e-9), frequency)
        assert found.frequency == pytest.approx(frequency, rel=1e-5) and found.damping == pytest.approx(damping, rel=1e-3)


@pytest.fixture(scope="module")
def trials() -> list:
    """What is found in 25 measurements of the same."""
    return [vibrations(TIMES, measured(seed)) for seed in range(25)]


@pytest.mark.parametrize(("frequency", "damping"), [(1.05, 0.008), (2.4, 0.02)])
def test_deviations_are_what_they_are_said_to_be(trials: list, frequency: float, damping: float) -> None:
    found = [min(trial, key=lambda each: abs(each.frequency - frequency)) for trial in trials]
    by_frequency = np.array([(each.frequency - frequency) / each.frequency_sigma for each in found])
    by_damping = np.array([(each.damping - damping) / each.damping_sigma for each in found])
    for normalised in (by_frequency, by_damping):
        assert 0.5 < np.sqrt(np.mean(normalised**2)) < 2.0


def test_in_noise_alone_nothing_is_sure() -> None:
    for seed in range(5):
        found = vibrations(TIMES, np.random.default_rng(seed).normal(0.0, 0.05, (len(TIMES), 2)))
        assert found and all(each.frequency_sigma * TIMES[-1] > 2.0 * CYCLE_SIGMA for each in found)


def test_missing_values_are_bridged() -> None:
    values = measured(2)
    values[::7, 0] = np.nan
    assert nearest(values, 1.05).frequency == pytest.approx(1.05, abs=0.01)


@pytest.mark.parametrize("rows", [0, 1, 100])
def test_too_little_gives_nothing(rows: int) -> None:
    assert vibrations(TIMES[:rows], measured(0)[:rows]) == []


def test_a_still_channel_gives_nothing() -> None:
    assert vibrations(TIMES, np.zeros((len(TIMES), 2))) == []


@pytest.mark.parametrize("load, payload, is_shaken", [(5.0, 0.0, False), (60.0, 0.0, True), (60.0, 3000.0, False)])
def test_where_a_load_shakes_the_boom_no_frequency_is_told(load: float, payload: float, is_shaken: bool) -> None:
    """The same decaying swing: under a pump it may be a line of that. A boom of five times the weight takes more."""
    scene = with_parameters(load_scene(), {"tip.payload": payload})
    imu = SimpleNamespace(stamps_s=TIMES, measured=measured(3))
    strokes = np.tile(strokes_of_posture(scene, "arch"), (len(TIMES), 1))
    finder = RestFinder(scene)
    history = SimpleNamespace(stamps_s=TIMES, strokes=strokes, imu=imu)
    finder.add(history, load * np.sin(2.7 * TIMES)[:, None] * np.array([0.0, 1.0]))  # type: ignore[arg-type]
    (rest,) = finder.finish()
    assert rest.is_shaken == is_shaken and (0 in rest.measured) == (not is_shaken and not payload)


@pytest.fixture(scope="module")
def swung():
    """Boom that a fast move of cylinder 1 leaves swinging: lengths swing with the force in the oil, drives rest."""
    times, drives = np.arange(0.0, 4.5, 0.005), np.tile(strokes_of_posture(load_scene(), "arch"), (900, 1))
    drives[:, 0] += 0.008 * np.clip(times / 0.4, 0.0, 1.0)
    return simulate(load_scene(), times, drives, dt=5e-3, estimate_errors=False)


@pytest.mark.parametrize("reads", list(StrokeReading))
def test_a_boom_on_locked_drives_rests_with_the_frequencies_of_its_drives(swung, reads: StrokeReading) -> None:
    """Whatever the transducers read; lengths that are taken for drives never rest, and give other frequencies."""
    scene, found = load_scene(), []
    twin, recording, finder = Twin(scene, reads=reads), Recording(4, found.append, reads=reads), RestFinder(scene)
    for time, row in zip(swung.times, swung.strokes if reads is StrokeReading.DRIVE else swung.lengths, strict=True):
        recording.add(twin.update(Sample(Stream.STROKES, SECOND + round(SECOND * float(time)), row)))
    recording.close()
    (stretch,) = found
    finder.add(own := HistoryBuilder(scene).add(stretch), stretch.estimates.load)
    (rest,) = finder.finish()
    assert rest.start < 1.0 and rest.stop > 4.3
    assert reads is StrokeReading.DRIVE or not still(own.stamps_s, stretch.predictions.strokes)
    expected = statics(scene, swung.strokes[-1]).frequencies
    assert rest.model == pytest.approx(expected, rel=5e-4)
    resting = replace(own, stamps_s=own.stamps_s[400:], strokes=own.strokes[400:])
    assert course(resting, scene)[1] == pytest.approx(np.tile(expected, (60, 1)), rel=1e-3)
    assert statics(scene, statics(scene, swung.strokes[-1]).lengths).frequencies != pytest.approx(expected, rel=3e-3)
