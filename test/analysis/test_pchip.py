"""The interpolant of stroke histories against SciPy's, which it replaces for its import time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from boom_twin.analysis.drive import pchip


@pytest.mark.parametrize("rows", [2, 3, 4, 50])
@pytest.mark.parametrize("seed", range(5))
def test_same_curve_as_scipy(rows: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(1e-3, 1.0, rows))
    y = np.round(rng.standard_normal((rows, 4)), rng.integers(0, 4))  # few digits: equal neighbours, slopes of zero
    at = np.concatenate([x, rng.uniform(x[0], x[-1], 200)])
    values, rates = pchip(x, y, at)
    curve = PchipInterpolator(x, y, axis=0)
    assert values == pytest.approx(curve(at), abs=1e-13)
    assert rates == pytest.approx(curve.derivative()(at), abs=1e-13 / np.diff(x).min())
