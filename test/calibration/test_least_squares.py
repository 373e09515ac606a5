"""What is taken over of a fit, where a part of its unknowns could not be told."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.calibration.least_squares import Fit


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
    found = fit_of(slopes, measured).without(left_out)
    assert found[kept] == pytest.approx(alone.deviations, rel=1e-9) and not found[left_out].any()
