"""Spectral density of residuals against SciPy's."""

import numpy as np
import pytest
from scipy.signal import welch

from boom_twin.plots.session_distributions import SEGMENT, density


@pytest.mark.parametrize("count", [20, 101, 3000, 7001])
def test_density_is_that_of_scipy(count: int) -> None:
    times = np.arange(count) * 0.005
    values = np.random.default_rng(count).normal(3.0, 1.0, count)
    even = np.arange(times[0], times[-1], 0.005)
    frequencies, power = welch(np.interp(even, times, values), 200.0, nperseg=min(len(even), round(SEGMENT / 0.005)))
    found = density(times, values, 0.005)
    np.testing.assert_allclose(found.frequencies, frequencies[1:])
    np.testing.assert_allclose(found.power, power[1:], rtol=1e-12)
