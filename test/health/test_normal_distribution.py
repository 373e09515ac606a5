"""Logarithm of the normal distribution function against SciPy's."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.special import log_ndtr

from boom_twin.health.inference.normal_distribution import FAR, log_normal_below


def test_it_is_that_of_scipy():
    values = np.concatenate([np.linspace(-60.0, 12.0, 7201), [FAR - 1e-9, FAR + 1e-9, 0.0, -1e6, -np.inf, np.inf]])
    assert log_normal_below(values) == pytest.approx(log_ndtr(values), rel=1e-13, abs=1e-300)
    assert log_normal_below(values[:6].reshape(2, 3)).shape == (2, 3)


def test_health_imports_no_scipy():
    """It would take half a second of a live twin's time at the first suspicion. What numba loads, a twin has already."""
    code = "import sys, boom_twin.health.monitor as m; from boom_twin.health.inference import hypotheses as h, block_kernels; "
    code += "print([n for n in sys.modules if n.startswith('scipy')]); "
    code += "block_kernels.largest_step(h.np.zeros(2), h.np.zeros(2)); numba = {*sys.modules}; "
    weigh = "h.log_normal_below(h.np.zeros(2)); print([n for n in sys.modules if n.startswith('scipy') and n not in numba])"
    found = subprocess.run([sys.executable, "-c", code + weigh], capture_output=True, text=True, check=True)
    assert found.stdout.split() == ["[]", "[]"]
