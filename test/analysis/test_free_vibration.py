"""Natural frequencies of free vibration: true error over stated deviation on closed forms, and pyOMA-2 as a witness."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.analysis.sample_series import Vibration, free_vibrations

DT, FREQUENCIES, DAMPINGS = 0.025, np.array([0.986, 2.64, 5.38]), np.array([0.008, 0.012, 0.02])
SHAPES = np.array([[1.0, 0.4], [0.5, -0.8], [0.3, 0.2]])
BLOCK_ROWS, ORDER, SEEDS = 60, 14, 20


def record(noise: float, seed: int) -> np.ndarray:
    """Two channels of 10 s of three modes that decay, and white noise; shape (400, 2)."""
    rng, times = np.random.default_rng(seed), DT * np.arange(400.0)
    waves = [
        np.exp(-damping * 2.0 * np.pi * f * times) * np.cos(2.0 * np.pi * f * np.sqrt(1.0 - damping**2) * times + phase)
        for f, damping, phase in zip(FREQUENCIES, DAMPINGS, rng.uniform(0.0, 2.0 * np.pi, 3), strict=True)
    ]
    return np.array(waves).T @ SHAPES + rng.normal(0.0, noise, (400, 2))


def nearest(values: np.ndarray) -> list[Vibration]:
    """What is found next to every true frequency."""
    found = free_vibrations(DT, values)
    return [min(found, key=lambda each: abs(each.frequency - frequency)) for frequency in FREQUENCIES]


def test_errors_are_as_large_as_stated() -> None:
    found = [nearest(record(0.05, seed)) for seed in range(100)]
    scores = [[(each.frequency - f) / each.frequency_sigma for each, f in zip(row, FREQUENCIES, strict=True)] for row in found]
    mean = np.square(scores).mean()
    assert abs(mean - 1.0) < 3.0 * np.sqrt(2.0 / np.size(scores)), "chi-square: three deviations of its mean"
    scores = [[(each.damping - d) / each.damping_sigma for each, d in zip(row, DAMPINGS, strict=True)] for row in found]
    assert 0.5 < np.sqrt(np.square(scores).mean()) < 2.0


def by_pyoma(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (Hz) and damping ratios by data-driven SSI of `ORDER`, nearest to those that are true."""
    ssi = pytest.importorskip("pyoma2.functions.ssi", reason="pyOMA-2 is in the extra peers")
    centred = (values - values.mean(axis=0)).T
    hankel, _ = ssi.build_hank(centred, centred, BLOCK_ROWS, "dat")
    observability, a, c, _ = ssi.SSI_fast(hankel, BLOCK_ROWS, ORDER)
    frequencies, dampings = ssi.SSI_poles(observability, a, c, ORDER, DT)[:2]
    own = frequencies[:, -1], dampings[:, -1]
    nearest = [int(np.nanargmin(np.abs(own[0] - frequency))) for frequency in FREQUENCIES]
    return own[0][nearest], own[1][nearest]


def test_without_noise_both_give_the_closed_form() -> None:
    values = record(0.0, 1)
    frequencies, dampings = by_pyoma(values)
    own = nearest(values)
    assert frequencies == pytest.approx(FREQUENCIES, rel=1e-4)
    assert [each.frequency for each in own] == pytest.approx(frequencies, rel=1e-4)
    assert [each.damping for each in own] == pytest.approx(dampings, abs=1e-4)


def test_with_noise_both_agree_on_average_and_ours_is_no_less_sure() -> None:
    own, witness = [], []
    for seed in range(SEEDS):
        values = record(0.05, seed)
        own.append([each.frequency for each in nearest(values)])
        witness.append(by_pyoma(values)[0])
    ours, theirs = np.array(own) / FREQUENCIES - 1.0, np.array(witness) / FREQUENCIES - 1.0
    apart = ours - theirs
    assert (np.abs(apart.mean(axis=0)) < 3.5 * apart.std(axis=0) / np.sqrt(SEEDS)).all()
    assert (ours.std(axis=0) < 1.2 * theirs.std(axis=0)).all(), "no less sure than the witness"
