"""What is taken over of a fit, where a part of its unknowns could not be told."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.calibration.least_squares import Fit, bounded_minimum


def fit_of(slopes: np.ndarray, measured: np.ndarray) -> Fit:
    """Of white residuals `measured` that deviations change by `slopes`, with the priors."""
    information = slopes.T @ slopes
    best = np.linalg.solve(information + np.eye(slopes.shape[1]), slopes.T @ measured)
    return Fit(best, information, information, 1.0, 1, None)  # type: ignore[arg-type] # the whitening has no part in this


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
