"""Logarithm of the normal distribution function.

`scipy.special` has it too, but takes half a second to import, which a live twin would lose at its first suspicion.
"""

from __future__ import annotations

import math

import numpy as np

from ...types import Array

FAR = -30.0
"""Below it the asymptotic series holds to rounding (Abramowitz and Stegun, 26.2.12), and before `math.erfc` underflows."""


def log_normal_below(values: Array) -> Array:
    """ln of the probability that a standard normal variable is below each of `values`, any shape; infinite ones too."""
    tails = 0.5 * np.array([math.erfc(each) for each in np.abs(values * math.sqrt(0.5)).ravel().tolist()]).reshape(values.shape)
    far = np.minimum(values, FAR)
    over2 = 1.0 / (far * far)
    series = 1.0 - over2 * (1.0 - 3.0 * over2 * (1.0 - 5.0 * over2 * (1.0 - 7.0 * over2)))
    log_far = -0.5 * far * far - np.log(-far * math.sqrt(2.0 * math.pi)) + np.log(series)
    near = np.where(values < 0.0, np.log(np.maximum(tails, 1e-300)), np.log1p(-tails))
    return np.asarray(np.where(values < FAR, log_far, near))
