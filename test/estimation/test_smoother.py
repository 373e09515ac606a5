"""The stroke smoother against a textbook Kalman filter with Rauch-Tung-Striebel smoothing, in numpy matrices."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.estimation.stroke_filter import QUIET, add_node, drive_between, measure, start_node

VARIANCE, DENSITY = 4e-10, 50.0
rng = np.random.default_rng(3)


def transition(h):
    f = np.array([[1.0, h, h * h / 2], [0.0, 1.0, h], [0.0, 0.0, 1.0]])
    column = [h**5 / 20, h**4 / 8, h**3 / 6]
    q = np.array([column, [h**4 / 8, h**3 / 3, h**2 / 2], [h**3 / 6, h**2 / 2, h]])
    return f, DENSITY * q


def smoothed(steps, samples):
    """Means and covariances of all nodes given all samples: filter forwards, smooth backwards."""
    h = np.array([1.0, 0.0, 0.0])
    x, p = np.array([samples[0], 0.0, 0.0]), np.diag([VARIANCE, QUIET, QUIET])
    filtered, predicted = [(x, p)], []
    for step, y in zip(steps, samples[1:], strict=True):
        f, q = transition(step)
        ahead, spread = f @ x, f @ p @ f.T + q
        predicted.append((f, ahead, spread))
        x, p = ahead, spread
        if np.isfinite(y):
            gain = p @ h / (h @ p @ h + VARIANCE)
            x, p = x + gain * (y - h @ x), p - np.outer(gain, h @ p)
        filtered.append((x, p))
    means = [filtered[-1][0]]
    for (x, p), (f, ahead, spread) in zip(filtered[-2::-1], predicted[::-1], strict=True):
        means.append(x + p @ f.T @ np.linalg.solve(spread, means[-1] - ahead))
    return np.array(means), filtered[-1][1]


@pytest.mark.parametrize("missing", [(), (4, 5)])
def test_every_node_of_the_window_is_the_smoothed_estimate(missing):
    steps = 5e-3 * rng.uniform(0.5, 1.5, 11)
    samples = 0.3 + 1e-3 * np.cumsum(rng.normal(size=12))
    samples[list(missing)] = np.nan
    x, c = np.zeros((12, 1, 3)), np.zeros((12, 1, 3, 3))
    start_node(x, c, samples[:1], VARIANCE)
    for count, (step, y) in enumerate(zip(steps, samples[1:], strict=True), start=1):
        add_node(x, c, count, step, DENSITY)
        measure(x, c, count + 1, np.array([y]), VARIANCE)
    means, covariance = smoothed(steps, samples)
    for order, scale in enumerate((1e-3, 1.0, 100.0)):
        assert x[:, 0, order] == pytest.approx(means[:, order], rel=1e-7, abs=1e-7 * scale)
    assert c[0, 0] == pytest.approx(covariance, rel=1e-6, abs=1e-12 * np.abs(covariance).max())


def test_strokes_do_not_mix():
    """Two strokes in one window are two windows of one."""
    samples = 0.2 + 1e-3 * rng.normal(size=(6, 2))
    together = np.zeros((6, 2, 3)), np.zeros((6, 2, 3, 3))
    alone = np.zeros((6, 1, 3)), np.zeros((6, 1, 3, 3))
    start_node(*together, samples[0], VARIANCE)
    start_node(*alone, samples[0, 1:], VARIANCE)
    for k in range(1, 6):
        for (x, c), y in ((together, samples[k]), (alone, samples[k, 1:])):
            add_node(x, c, k, 5e-3, DENSITY)
            measure(x, c, k + 1, y, VARIANCE)
    assert np.array_equal(together[0][:, 1], alone[0][:, 0])


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
