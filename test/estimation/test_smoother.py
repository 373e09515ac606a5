"""The bank of stroke smoothers against a textbook Kalman filter with Rauch-Tung-Striebel smoothing, in numpy matrices."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.estimation.stroke_filter import (
    CHANGES,
    JERK_DENSITIES,
    PRIOR,
    QUIET,
    drive_between,
    filter_tuning,
    new_filter,
    start_filter,
    take_strokes,
)

VARIANCE = 4e-10
rng = np.random.default_rng(3)


def transition(h, density):
    f = np.array([[1.0, h, h * h / 2], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
    column = [h**5 / 20, h**4 / 8, h**3 / 6]
    q = np.array([column, [h**4 / 8, h**3 / 3, h**2 / 2], [h**3 / 6, h**2 / 2, h]])
    return f, density * q


def smoothed(density, steps, samples):
    """Means of all nodes given all samples, newest covariance, innovations: filter forwards, smooth backwards."""
    h = np.array([1.0, 0.0, 0.0])
    x, p = np.array([samples[0], 0.0, 0.0]), np.diag([VARIANCE, QUIET, QUIET])
    filtered, predicted, innovations = [(x, p)], [], []
    for step, y in zip(steps, samples[1:], strict=True):
        f, q = transition(step, density)
        ahead, spread = f @ x, f @ p @ f.T + q
        predicted.append((f, ahead, spread))
        x, p = ahead, spread
        innovations.append((y - h @ x, h @ p @ h + VARIANCE))
        gain = p @ h / (h @ p @ h + VARIANCE)
        x, p = x + gain * (y - h @ x), p - np.outer(gain, h @ p)
        filtered.append((x, p))
    means = [filtered[-1][0]]
    for (x, p), (f, ahead, spread) in zip(filtered[-2::-1], predicted[::-1], strict=True):
        means.append(x + p @ f.T @ np.linalg.solve(spread, means[-1] - ahead))
    return np.array(means), filtered[-1][1], innovations


def filtered(steps, samples, agility=1.0, nodes=31):
    """A bank of smoothers, with a window of so many nodes, that has taken samples (k, n)."""
    bank, tuning = new_filter(samples.shape[1], nodes), filter_tuning(VARIANCE, agility)
    start_filter(bank, tuning, samples[0])
    for count, (step, y) in enumerate(zip(steps, samples[1:], strict=True), start=1):
        take_strokes(bank, tuning, min(count, nodes - 1), step, y)
    return bank


def test_every_node_of_every_smoother_is_the_smoothed_estimate():
    steps = 5e-3 * rng.uniform(0.5, 1.5, 11)
    samples = 0.3 + 1e-3 * np.cumsum(rng.normal(size=12))
    bank = filtered(steps, samples[:, None], agility=3.0)
    for m, density in enumerate(3.0 * JERK_DENSITIES):
        means, covariance, _ = smoothed(density, steps, samples)
        for order, scale in enumerate((1e-3, 1.0, 100.0)):
            assert bank.x[m, :12, 0, order] == pytest.approx(means[:, order], rel=1e-7, abs=1e-7 * scale)
        assert bank.c[m, 0] == pytest.approx(covariance, rel=1e-6, abs=1e-12 * np.abs(covariance).max())


def test_probabilities_follow_from_the_likelihoods_of_all_innovations():
    """The Markov chain of densities by hand, and the mixture's mean and covariance."""
    steps = 5e-3 * rng.uniform(0.5, 1.5, 30)
    samples = 0.3 + 2e-5 * rng.normal(size=31) + 3e-4 * np.sin(30.0 * np.cumsum([0.0, *steps]))
    bank, chances = filtered(steps, samples[:, None]), PRIOR.copy()
    runs = [smoothed(density, steps, samples) for density in JERK_DENSITIES]
    for k, step in enumerate(steps):
        drawn = 1.0 - np.exp(-CHANGES * step)
        likelihoods = [np.exp(-0.5 * nu * nu / s) / np.sqrt(s) for nu, s in (run[2][k] for run in runs)]
        chances = ((1.0 - drawn) * chances + drawn * PRIOR) * likelihoods
        chances /= chances.sum()
    assert bank.weights[0] == pytest.approx(chances, rel=1e-5)
    nodes = sum(chance * means for chance, (means, _, _) in zip(chances, runs, strict=True))
    assert bank.nodes[:, 0, 0] == pytest.approx(nodes[:, 0], abs=1e-9)
    apart = [means[0] - nodes[0] for means, _, _ in runs]
    covariance = sum(c * (p + np.outer(d, d)) for c, d, (_, p, _) in zip(chances, apart, runs, strict=True))
    assert bank.covariance[0] == pytest.approx(covariance, rel=1e-4, abs=1e-9 * np.abs(covariance).max())


def test_a_stroke_that_is_not_measured_goes_on_as_it_went():
    """A move at 0.2 m/s: 20 samples without a reading leave the estimate within 1 mm, and its probabilities as they were."""
    times = 5e-3 * np.arange(101)
    samples = 0.2 * times + 1e-5 * rng.normal(size=101)
    samples[81:] = np.nan
    bank = filtered(np.diff(times), samples[:, None])
    assert bank.nodes[0, 0, 0] == pytest.approx(0.2 * times[-1], abs=1e-3)
    assert bank.weights[0] == pytest.approx(filtered(np.diff(times[:81]), samples[:81, None]).weights[0], rel=1e-12)


def test_strokes_do_not_mix():
    """Two strokes in one bank are two banks of one."""
    samples, steps = 0.2 + 1e-3 * rng.normal(size=(6, 2)), np.full(5, 5e-3)
    together, alone = filtered(steps, samples), filtered(steps, samples[:, 1:])
    assert np.array_equal(together.nodes[:, 1], alone.nodes[:, 0])


def test_noise_is_followed_and_what_is_quicker_than_samples_is_not():
    """One outlier is no motion; a stroke that goes to and fro from sample to sample is one that no smoother can follow."""
    steps, noise = np.full(400, 5e-3), 2e-5 * rng.normal(size=(401, 1))
    noise[200] += 1e-3
    assert filtered(steps, noise, nodes=2).excesses[0] == 0.0
    swinging = noise + 2e-4 * np.where(np.arange(401) % 4 < 2, 1.0, -1.0)[:, None]
    lost = filtered(steps, swinging, nodes=2)
    assert lost.is_lost[0] and lost.covariance[0, 0, 0] > 2e-4**2 / 2.0


def test_quintic_meets_both_nodes_and_its_rate_is_its_slope():
    old, new, span = rng.normal(size=3), rng.normal(size=3), 7e-3
    ends = [drive_between(old, new, span, share) for share in (0.0, 1.0)]
    assert ends[0] == pytest.approx(old[:2])
    assert ends[1] == pytest.approx(new[:2], rel=1e-9)
    size = 1e-5
    for share in (0.0, 0.37, 1.0):
        sides = [drive_between(old, new, span, share + sign * size) for sign in (1.0, -1.0)]
        slope = (sides[0][0] - sides[1][0]) / (2 * size * span)
        assert drive_between(old, new, span, share)[1] == pytest.approx(slope, rel=1e-5, abs=1e-5)
    bends = [
        (drive_between(old, new, span, share + size)[1] - drive_between(old, new, span, share - size)[1]) / (2 * size * span)
        for share in (0.0, 1.0)
    ]
    assert bends == pytest.approx([old[2], new[2]], rel=1e-4, abs=2e-3 * np.abs(new).max() / span)
