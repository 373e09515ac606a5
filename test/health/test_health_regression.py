"""Regression, block by block, against the same in one dense step."""

from __future__ import annotations

import numpy as np
import pytest
from health.gaussian import covariance_of, log_density

from boom_twin.health.inference.hypotheses import GATE, Regression


@pytest.mark.parametrize("seed", range(5))
def test_blocks_one_by_one_are_one_dense_regression(seed):
    rng = np.random.default_rng(seed)
    mean, covariance = rng.normal(size=4), covariance_of(rng, 4)
    signature = rng.normal(size=(12, 4))
    values = signature @ rng.multivariate_normal(mean, covariance) + rng.normal(size=12)
    regression, log = Regression(mean, covariance), 0.0
    for rows in (slice(0, 5), slice(5, 6), slice(6, 12)):
        left, spread = regression.take(np.column_stack([values[rows], signature[rows]]), True)
        log += -0.5 * float(left @ left) - spread
    prior = np.linalg.inv(covariance)
    information = prior + signature.T @ signature
    assert regression.covariance == pytest.approx(np.linalg.inv(information), abs=1e-10)
    assert regression.mean == pytest.approx(np.linalg.solve(information, prior @ mean + signature.T @ values), abs=1e-9)
    dense = log_density(values, signature @ mean, np.eye(12) + signature @ covariance @ signature.T)
    assert log == pytest.approx(dense, abs=1e-9), "the probability of all blocks is that of the dense problem"


def test_what_is_left_has_unit_variance():
    rng = np.random.default_rng(7)
    covariance, signature = covariance_of(rng, 3), rng.normal(size=(2, 3))
    found = []
    for _ in range(4000):
        white = signature @ rng.multivariate_normal(np.zeros(3), covariance) + rng.normal(size=2)
        found.append(Regression(np.zeros(3), covariance).take(np.column_stack([white, signature]), False)[0])
    assert np.cov(np.array(found).T) == pytest.approx(np.eye(2), abs=4.5 * np.sqrt(2.0 / 4000))


def test_nothing_is_learnt_where_it_must_not_be():
    regression = Regression(np.zeros(1), np.eye(1))
    regression.take(np.array([[1.0, 1.0]]), False)
    far = (GATE + 0.1) * np.sqrt(2.0)
    left, _ = regression.take(np.array([[far, 1.0]]), True)
    assert left[0] == pytest.approx(GATE + 0.1)
    assert (regression.mean[0], regression.covariance[0, 0]) == (0.0, 1.0), "beyond the gate, and where told not to"
    regression.take(np.array([[1.0, 1.0]]), True)
    assert (regression.mean[0], regression.covariance[0, 0]) == (pytest.approx(0.5), pytest.approx(0.5))


def test_what_it_is_given_stays_as_it_was():
    mean, covariance = np.zeros(1), np.eye(1)
    Regression(mean, covariance).take(np.array([[1.0, 1.0]]), True)
    assert (mean[0], covariance[0, 0]) == (0.0, 1.0)
