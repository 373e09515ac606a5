"""Residuals of noise become white, of unit variance, and constants are followed."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from boom_twin.calibration.noise_model import whitening_of


def ringing(rng, kinds, count):
    """Two channels with noise of their own, and a slow resonance that both share."""
    swing = lfilter([1.0], [1.0, -1.96, 0.985], 0.05 * rng.standard_normal((kinds, count + 500)), axis=1)[:, 500:]
    own = rng.standard_normal((kinds, count, 2)) * [0.5, 2.0]
    return own + swing[..., None] * [1.0, -1.5]


def test_noise_that_it_was_not_fitted_to_is_white():
    rng = np.random.default_rng(0)
    filter_ = whitening_of([ringing(rng, 20, 800)], 0.05)
    white = filter_(ringing(rng, 40, 800))
    flat = white.reshape(-1, 2)
    np.testing.assert_allclose(np.cov(flat.T), np.eye(2), atol=0.05)
    for lag in (1, 2, 5, 20):
        both = np.einsum("kti,ktj->ij", white[:, lag:], white[:, :-lag]) / white[:, lag:, 0].size
        np.testing.assert_allclose(both, 0.0, atol=0.05)


def test_a_missing_block_takes_those_after_it_with_it():
    rng = np.random.default_rng(1)
    noise = ringing(rng, 20, 300)
    filter_ = whitening_of([noise], 0.05)
    order = len(filter_.past)
    one = noise[0].copy()
    one[100, 1] = np.nan
    white = filter_(one)
    assert np.flatnonzero((white == 0.0).all(axis=1)).tolist() == list(range(100 - order, 101))


def test_constants():
    rng = np.random.default_rng(2)
    filter_ = whitening_of([ringing(rng, 20, 300)], 0.05)
    level = np.array([0.3, -0.2])
    np.testing.assert_allclose(filter_(np.tile(level, (100, 1)))[-1], filter_.of_constant(level), rtol=1e-9)
