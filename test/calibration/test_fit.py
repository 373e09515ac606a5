"""A fit: unknowns that are left out, bounds, and the covariance of what may be wrong with the model."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.calibration.fit import Fit, bounded_minimum


def fit_of(slopes: np.ndarray, measured: np.ndarray, by_model: np.ndarray | None = None) -> Fit:
    """Of white residuals `measured` that deviations change by `slopes`, with the priors."""
    information, unknowns = slopes.T @ slopes, slopes.shape[1]
    best = np.linalg.solve(information + np.eye(unknowns), slopes.T @ measured)
    none = np.zeros((unknowns, 0)) if by_model is None else by_model
    return Fit(best, information, information, np.zeros(unknowns), none, np.ones(0), 1)


@pytest.mark.parametrize("left_out", [[1], [0, 3], []])
def test_what_is_left_out_is_made_up_for_by_the_others(left_out: list[int]) -> None:
    """As if these had never been unknown: the minimum of the same squares where they stay 0."""
    random = np.random.default_rng(len(left_out))
    slopes, measured = 30.0 * random.normal(size=(50, 4)), 30.0 * random.normal(size=50)
    slopes[:, 1] = 0.98 * slopes[:, 2] + 0.2 * slopes[:, 1]  # two that look nearly alike
    kept = [i for i in range(4) if i not in left_out]
    alone = fit_of(slopes[:, kept], measured)
    found = fit_of(slopes, measured).without(left_out, np.full(4, -np.inf))
    assert found[kept] == pytest.approx(alone.deviations, rel=1e-9) and not found[left_out].any()


def test_a_payload_is_not_taken_over_below_its_bound() -> None:
    """The others make up for what is left out, and not by a negative mass; on a bound they are what fits best there."""
    random = np.random.default_rng(5)
    slopes = 30.0 * random.normal(size=(50, 3))
    slopes[:, 1] = 0.98 * slopes[:, 0] + 0.2 * slopes[:, 1]
    fit, least = fit_of(slopes, slopes @ [0.5, -0.6, 1.0]), np.array([-np.inf, -0.1, -np.inf])
    assert fit.without([0], np.full(3, -np.inf))[1] < -0.1
    assert fit.without([0], least)[1] == pytest.approx(-0.1)

    precision, pull = slopes.T @ slopes + np.eye(3), slopes.T @ (slopes @ [0.5, -0.6, 1.0])
    found = bounded_minimum(precision, pull, least)
    slope = precision @ found - pull
    assert found[1] == pytest.approx(-0.1) and slope[1] > 0.0 and slope[[0, 2]] == pytest.approx(0.0, abs=1e-6)


def test_the_covariance_allows_for_what_may_be_wrong_with_the_model() -> None:
    """Monte Carlo: readings with noise, and with a parameter that the fit does not know, of deviation 1."""
    random = np.random.default_rng(6)
    slopes, other = 5.0 * random.normal(size=(80, 2)), 3.0 * random.normal(size=80) + 2.0
    fit = fit_of(slopes, np.zeros(80), slopes.T @ other[:, None])
    readings = random.normal(size=(20000, 80)) + random.normal(size=(20000, 1)) * other
    errors = np.linalg.solve(fit.precision, slopes.T @ readings.T)
    np.testing.assert_allclose(fit.covariance(), np.cov(errors) + np.linalg.inv(fit.precision) @ np.linalg.inv(fit.precision),
                               rtol=0.06, atol=2e-5)  # fmt: skip
