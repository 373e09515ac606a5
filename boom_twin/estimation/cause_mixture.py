"""Mixture of the estimate over its causes: no cylinder is softer than the scene says, or one of them is, or all.

Why: `boom_twin.estimation.tip_estimate`. Rows read the state; their means and covariances here are those of the mixture.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .deviation_filter import FED, SCENE_ERROR, SHARES, SOFT, covary

ONE_SOFT, ALL_SOFT = 0.02, 0.005  # chances that one certain cylinder is not, and that none is


@inner
def weigh_causes(f):
    """Chances of the causes, and what a reading of a = 0 of all cylinders would change: `inverse`, `drag`.

    With P the covariance of the shares a, m their mean, R the square of `SCENE_ERROR` and W the wide variance that the filter
    began with, a cause under which the cylinders K are as the scene says has the chance N(0; m_K, P_KK + R) / N(0; 0, W + R)
    times its prior. Of K without one cylinder all follows from the inverse B of P + R: B_ii of that one is all it takes.
    """
    n, wide = f.softness.shape[0], SOFT * SOFT + 2.0 * SCENE_ERROR * SCENE_ERROR
    size2 = SCENE_ERROR * SCENE_ERROR
    f.chances[:] = 0.0
    f.chances[n + 1] = 1.0
    if f.status[FED] == 0:
        return
    b = f.inverse
    for i in range(n):
        for k in range(n):
            b[i, k] = f.p[SHARES + i, SHARES + k]
        b[i, i] += size2
    doubt = invert(b)
    if not math.isfinite(doubt):
        return
    free, cost = 0, 0.0
    for i in range(n):
        f.drag[i] = 0.0
        for k in range(n):
            f.drag[i] += b[i, k] * f.x[SHARES + k]
    for i in range(n):
        cost += f.drag[i] * f.x[SHARES + i]
        free += 1 if f.softness[i] > 0.0 else 0
    wide_log = math.log(wide)
    rigid = (n - free) * math.log(size2)
    healthy = 0.5 * (free * wide_log + rigid - doubt - cost) + math.log(1.0 - free * min(ONE_SOFT, 0.5 / n) - ALL_SOFT)
    f.chances[0] = healthy
    f.chances[n + 1] = math.log(ALL_SOFT)
    most = max(healthy, f.chances[n + 1])
    for i in range(n):
        f.chances[1 + i] = -math.inf
        if f.softness[i] > 0.0:
            own = 0.5 * (f.drag[i] * f.drag[i] / b[i, i] - math.log(b[i, i]) - wide_log)
            f.chances[1 + i] = 0.5 * (free * wide_log + rigid - doubt - cost) + own + math.log(min(ONE_SOFT, 0.5 / n))
            most = max(most, f.chances[1 + i])
    total = 0.0
    for i in range(n + 2):
        f.chances[i] = math.exp(f.chances[i] - most)
        total += f.chances[i]
    for i in range(n + 2):
        f.chances[i] /= total


@inner
def invert(b):
    """A symmetric positive definite matrix becomes its inverse, by Gauss-Jordan; gives the logarithm of its determinant."""
    n, log = b.shape[0], 0.0
    for k in range(n):
        pivot = b[k, k]
        if not pivot > 0.0:
            return math.nan
        log += math.log(pivot)
        b[k, k] = 1.0
        for j in range(n):
            b[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = b[i, k]
                b[i, k] = 0.0
                for j in range(n):
                    b[i, j] -= factor * b[k, j]
    return log


@inner
def shift_by(f, a, cause):
    """By how much a cause (0 none, i cylinder i) changes what row a reads."""
    n, shift = f.softness.shape[0], 0.0
    for i in range(n):
        shift -= f.cross[a, i] * f.drag[i]
    if cause > 0:
        shift += f.healed[a, cause - 1] * f.drag[cause - 1] / f.inverse[cause - 1, cause - 1]
    return shift


@inner
def mean_of(f, a, size):
    """What row a reads, by the chances of the causes."""
    total = 0.0
    for k in range(size):
        total += f.rows[a, k] * f.x[k]
    for cause in range(f.softness.shape[0] + 1):
        if f.chances[cause] > 0.0:
            total += f.chances[cause] * f.shifts[a, cause]
    return total


@inner
def read_covariances(f, size):
    """Of every row its covariance with the rows of its own three or two and with the shares, before causes are weighed."""
    n = f.softness.shape[0]
    for a in range(8):
        covary(f.p, f.rows[a], f.gain, size)
        for b in range(a, min(a - a % 3 + 3, 8)):
            total = 0.0
            for k in range(size):
                total += f.rows[b, k] * f.gain[k]
            f.within[a, b] = total
        for i in range(n):
            f.cross[a, i] = f.gain[SHARES + i]
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += f.inverse[i, k] * f.cross[a, k]
            f.healed[a, i] = total
        for cause in range(n + 1):
            f.shifts[a, cause] = shift_by(f, a, cause)


@inner
def covariance_of(f, a, b):
    """Of what two rows read: that within each cause, and that of the causes' means."""
    n, total, shift_a, shift_b = f.softness.shape[0], f.within[a, b], 0.0, 0.0
    for i in range(n):
        total -= (1.0 - f.chances[n + 1]) * f.cross[a, i] * f.healed[b, i]
    for cause in range(n + 1):
        chance = f.chances[cause]
        if chance > 0.0:
            one, other = f.shifts[a, cause], f.shifts[b, cause]
            total += chance * one * other
            shift_a, shift_b = shift_a + chance * one, shift_b + chance * other
            if cause > 0:
                total += chance * f.healed[a, cause - 1] * f.healed[b, cause - 1] / f.inverse[cause - 1, cause - 1]
    return total - shift_a * shift_b


@inner
def write_covariance(f, first, out):
    """Upper triangle of the covariance of three rows."""
    at = 0
    for a in range(first, first + 3):
        for b in range(a, first + 3):
            out[at] = covariance_of(f, a, b)
            at += 1
