"""What is compiled of the look at a block of readings, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.health.blocks import BLOCK, MeasuredRows
from boom_twin.health.sensor_check import NOISY_WINDOW, SensorCheck
from boom_twin.health.stream_readings import StreamReadings, StreamSurvey
from boom_twin.types import NANO, Array

from .numpy_findings import bends2, findings_of, rough2

SIGMA = 2.0


def readings(seed: int, rows: int = 20, channels: int = 4) -> Array:
    return np.random.default_rng(seed).normal(3.0, SIGMA, (rows, channels))


def taken(raw: Array, left: Array, masked: Array | None = None) -> StreamReadings:
    """Return what a survey says of one block."""
    survey = StreamSurvey(SIGMA**2, raw.shape[1])
    none = np.zeros(raw.shape[1], dtype=bool)
    stamps = 7 * BLOCK + 5_000_000 * np.arange(len(raw))
    return survey.take(
        MeasuredRows(stamps, raw, left, np.full(raw.shape, 3.0)), none if masked is None else masked, BLOCK * NANO
    )


def test_means_of_readings_some_of_which_are_missing() -> None:
    left = readings(1)
    left[3, 0], left[:, 2] = np.nan, np.nan
    found = taken(left + 1.0, left)
    assert found.counts.tolist() == [19.0, 20.0, 0.0, 20.0]
    assert found.off[0] == pytest.approx(np.nanmean(left[:, 0])) and found.off[2] == 0.0
    assert found.slow.weight == pytest.approx([0.05, 0.05, 0.0, 0.05])
    assert found.slow.expected[[0, 1, 3]] == pytest.approx([0.05] * 3) and found.slow.expected[2] == 0.0
    assert found.slow.squares[1] == pytest.approx(0.05 * (left[:, 1] ** 2).mean())
    assert found.slow.variance[:2] == pytest.approx([0.05 * 9.0] * 2)


def test_rates_are_those_of_what_is_expected() -> None:
    """From the first reading to the last; unknown of one alone, or where the model has nothing."""
    expected = 3.0 * 0.005 * np.arange(20.0)[:, None] * np.array([1.0, -2.0])
    left = np.random.default_rng(3).normal(size=(20, 2))
    found = taken(expected + left, left)
    assert found.rates == pytest.approx([3.0, -6.0]) and found.slow.rate == pytest.approx([0.15, -0.3])
    assert np.isnan(taken(expected[:1], left[:1]).rates).all() and np.isnan(taken(expected, left * np.nan).rates).all()


def test_motion_bends_readings_smoothly_and_noise_does_not() -> None:
    """Against what it is by numpy's differences, over sines of all frequencies with noise."""
    times, told = np.arange(20.0)[:, None] / 200.0, []
    for seed in range(200):
        frequency = np.random.default_rng(seed).uniform(1.0, 90.0)
        raw = readings(seed) + 8.0 * SIGMA * np.sin(2.0 * np.pi * frequency * times + np.arange(4.0))
        masked = np.arange(4) == seed % 5
        trusted = raw[:, ~masked]
        power, rougher = bends2(trusted).sum(axis=0), rough2(trusted).sum(axis=0)
        wanted = bool(((power > 3.0 * SIGMA**2 * 18) & (rougher < 0.75 * power)).any())
        assert taken(raw, raw, masked).is_bent is wanted
        told.append(wanted)
    assert 20 < sum(told) < 180
    assert not taken(readings(1), readings(1)).is_bent
    assert not taken(np.zeros((0, 4)), np.zeros((0, 4))).is_bent


@pytest.mark.parametrize("fastest", [0.0, 2000.0])
def test_what_is_found_in_a_block_is_what_numpy_finds(fastest: float) -> None:
    """Readings that are noisy, repeated, missing, out of range, have spikes or jump, some of them just within the limits."""
    check, rng = SensorCheck(SIGMA, 0.0, np.full(2, -90.0), np.full(2, 90.0), fastest), np.random.default_rng(5)
    calm, told, level = 0, set[str](), np.zeros(2)
    for block in range(600):
        rows = 50 if block % 17 == 0 else 20
        times = 0.1 * block + 0.005 * np.arange(float(rows))
        if block % 3 == 0:
            times += rng.uniform(-0.002, 0.002, rows)
        raw = level + rng.normal(0.0, SIGMA, (rows, 2)) * rng.choice([1.0, 2.4, 2.6], 2)
        if block % 7 == 0:
            raw[5:, rng.integers(2)] = raw[4, 0]
        if 310 <= block < 320:
            raw[:, 0] = 7.0
        if 400 <= block < 430:
            raw[:, 1] *= 8.0
        if block % 11 == 0:
            raw[rng.integers(20), 1] += rng.choice([7.0, 8.5, 30.0, 100.0]) * SIGMA
        if block % 13 == 0:
            raw[:12, 0] = np.nan
        if block % 19 == 0:
            step = rng.choice([9.0, 11.0, 25.0]) * rng.choice([-SIGMA, SIGMA], 2)
            raw[rng.integers(rows) :] += step
            level = 0.5 * level + step
        now = times[-1] + 0.005 + (0.6 if block % 23 == 0 else 0.0)
        found = check.look(times, raw, np.zeros_like(raw), now)
        with np.errstate(invalid="ignore"):
            wanted = findings_of(check._known, rows, now, block > NOISY_WINDOW / 0.1, fastest)
        jumped = wanted.pop("jump")
        assert found.jumped.tolist() == jumped
        assert {kind: flags.tolist() for kind, flags in found.by_kind().items() if kind != "jump"} == wanted
        assert found.is_calm is not any(map(any, (*wanted.values(), jumped)))
        calm += found.is_calm
        told |= {kind for kind, flags in wanted.items() if any(flags)} | ({"jump"} if any(jumped) else set())
    assert 50 < calm < 580 and told == {"stuck", "noise", "spikes", "jump", "dropout", "range"}
