"""Dense Gaussians: what a filter, a regression or a bank of hypotheses must agree with."""

from __future__ import annotations

import numpy as np


def log_density(values: np.ndarray, mean: np.ndarray, covariance: np.ndarray) -> float:
    """Logarithm of the normal density, without the factor of 2 pi."""
    left = values - mean
    _, log_det = np.linalg.slogdet(covariance)
    return float(-0.5 * left @ np.linalg.solve(covariance, left) - 0.5 * log_det)


def covariance_of(rng: np.random.Generator, size: int, scale: float = 1.0) -> np.ndarray:
    """A random one that is positive definite."""
    root = rng.normal(size=(size, size))
    return scale**2 * (root @ root.T / size + 0.1 * np.eye(size))


def is_white(rows: np.ndarray, sigmas: float = 4.5) -> None:
    """Each column has mean 0, variance 1 and no correlation with itself one row later nor with other columns."""
    count = len(rows)
    bound = sigmas / np.sqrt(count)
    assert np.abs(rows.mean(axis=0)).max() < bound
    assert np.abs(rows.var(axis=0) - 1.0).max() < np.sqrt(2.0) * bound
    assert np.abs((rows[1:] * rows[:-1]).mean(axis=0)).max() < bound
    cross = rows.T @ rows / count
    assert np.abs(cross - np.diag(np.diag(cross))).max() < bound
