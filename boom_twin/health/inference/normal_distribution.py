"""Logarithm of the normal distribution function.

`scipy.special` has it too, but takes half a second to import, which a live twin would lose at its first suspicion.
"""

from __future__ import annotations

import math

import numpy as np

from ...kernels.jit import SameTypes, inner, kernel
from ...types import Array

FAR = -30.0
"""Below it the asymptotic series holds to rounding (Abramowitz and Stegun, 26.2.12), and before `math.erfc` underflows."""


def log_normal_below(values: Array) -> Array:
    """ln of the probability that a standard normal variable is below each of `values`, any shape; infinite ones too."""
    found = np.empty(values.shape)
    _write_logs(np.ascontiguousarray(values).reshape(-1), found.reshape(-1))
    return found


@kernel
def write_logs(values: Array, found: Array) -> None:
    """Write the same of values (k,)."""
    for i in range(values.shape[0]):
        found[i] = log_below(values[i])


@inner
def log_below(value: float) -> float:
    """The same of one value."""
    tail = 0.5 * math.erfc(abs(value * math.sqrt(0.5)))
    if value < FAR:
        over2 = 1.0 / (value * value)
        series = 1.0 - over2 * (1.0 - 3.0 * over2 * (1.0 - 5.0 * over2 * (1.0 - 7.0 * over2)))
        log_size = math.log(-value * math.sqrt(2.0 * math.pi))
        return -0.5 * value * value - log_size + math.log(series)
    return math.log(tail) if value < 0.0 else math.log1p(-tail)


_write_logs = SameTypes(write_logs)
