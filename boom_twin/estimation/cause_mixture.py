"""Mixture of the estimate over its causes: no cylinder is softer than the scene says, or one of them is, or all.

The others are as the scene says to one of `SCENE_ERRORS`. Why: `boom_twin.estimation.tip_estimate`. Rows read the state; their
means and covariances here are those of the mixture.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner
from .deviation_filter import FED, SCENE_ERROR, SCENE_ERRORS, SHARES, SOFT, covary

ONE_SOFT, ALL_SOFT = 0.02, 0.005  # chances that one certain cylinder is not, and that none is
LEVELS = len(SCENE_ERRORS)  # each as likely as another


@inner
def cause_place(f, level, soft):
    """Place in `chances` and `shifts` of the cause that all are as the scene says to that level but cylinder `soft`, 0 none."""
    return level * (f.softness.shape[0] + 1) + soft


@inner
def weigh_causes(f):
    """Chances of the causes, and what a reading of a = 0 of all cylinders would change: `inverse`, `drag`."""
    last = f.chances.shape[0] - 1
    f.chances[:] = 0.0
    f.chances[last] = 1.0
    if f.status[FED] == 0:
        return
    f.chances[last] = math.log(ALL_SOFT)
    most = f.chances[last]
    for level in range(LEVELS):
        most = max(most, weigh_level(f, level))
    total = 0.0
    for k in range(last + 1):
        f.chances[k] = math.exp(f.chances[k] - most)
        total += f.chances[k]
    for k in range(last + 1):
        f.chances[k] /= total


@inner
def weigh_level(f, level):
    """Logarithms of the chances of the causes of one level, but for a factor common to all; gives the largest.

    With P the covariance of the shares a, m their mean, R the square of the level and W the wide variance that the filter
    began with, a cause under which the cylinders K are as the scene says has the chance N(0; m_K, P_KK + R) / N(0; 0, W + R)
    times its prior. Of K without one cylinder all follows from the inverse B of P + R: B_ii of that one is all it takes.
    """
    n, size2 = f.softness.shape[0], SCENE_ERRORS[level] * SCENE_ERRORS[level]
    wide_log = math.log(SOFT * SOFT + SCENE_ERROR * SCENE_ERROR + size2)
    b, drag = f.inverse[level], f.drag[level]
    for i in range(n):
        for k in range(n):
            b[i, k] = f.p[SHARES + i, SHARES + k]
        b[i, i] += size2
    doubt = invert(b)
    free, cost, one = 0, 0.0, min(ONE_SOFT, 0.5 / n)
    for i in range(n):
        drag[i] = 0.0
        for k in range(n):
            drag[i] += b[i, k] * f.x[SHARES + k]
    for i in range(n):
        cost += drag[i] * f.x[SHARES + i]
        free += 1 if f.softness[i] > 0.0 else 0
    alike = 0.5 * (free * wide_log + (n - free) * math.log(size2) - doubt - cost) - math.log(LEVELS)
    most = alike + math.log(1.0 - free * one - ALL_SOFT) if math.isfinite(doubt) else -math.inf
    f.chances[cause_place(f, level, 0)] = most
    for i in range(n):
        place = cause_place(f, level, 1 + i)
        f.chances[place] = -math.inf
        if f.softness[i] > 0.0 and math.isfinite(doubt):
            own = 0.5 * (drag[i] * drag[i] / b[i, i] - math.log(b[i, i]) - wide_log)
            f.chances[place] = alike + own + math.log(one)
            most = max(most, f.chances[place])
    return most


@inner
def chance_of_soft(f):
    """Chance that a cylinder is softer than the scene says, or all are."""
    total = 1.0
    for level in range(LEVELS):
        total -= f.chances[cause_place(f, level, 0)]
    return total


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
def shift_by(f, a, level, soft):
    """By how much a cause (soft: 0 none, i cylinder i) changes what row a reads."""
    drag, shift = f.drag[level], 0.0
    for i in range(f.softness.shape[0]):
        shift -= f.cross[a, i] * drag[i]
    if soft > 0:
        shift += f.healed[level, a, soft - 1] * drag[soft - 1] / f.inverse[level, soft - 1, soft - 1]
    return shift


@inner
def mean_of(f, a, size):
    """What row a reads, by the chances of the causes."""
    total = 0.0
    for k in range(size):
        total += f.rows[a, k] * f.x[k]
    for cause in range(f.shifts.shape[1]):
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
        for level in range(LEVELS):
            for i in range(n):
                total = 0.0
                for k in range(n):
                    total += f.inverse[level, i, k] * f.cross[a, k]
                f.healed[level, a, i] = total
            for soft in range(n + 1):
                f.shifts[a, cause_place(f, level, soft)] = shift_by(f, a, level, soft)


@inner
def covariance_of(f, a, b):
    """Of what two rows read: that within each cause, and that of the causes' means."""
    n, total, shift_a, shift_b = f.softness.shape[0], f.within[a, b], 0.0, 0.0
    for level in range(LEVELS):
        healed, chances, known = f.healed[level], 0.0, 0.0
        for soft in range(n + 1):
            place = cause_place(f, level, soft)
            chance = f.chances[place]
            if chance > 0.0:
                chances += chance
                one, other = f.shifts[a, place], f.shifts[b, place]
                total += chance * one * other
                shift_a, shift_b = shift_a + chance * one, shift_b + chance * other
                if soft > 0:
                    total += chance * healed[a, soft - 1] * healed[b, soft - 1] / f.inverse[level, soft - 1, soft - 1]
        for i in range(n):
            known += f.cross[a, i] * healed[b, i]
        total -= chances * known
    return total - shift_a * shift_b


@inner
def write_covariance(f, first, out):
    """Upper triangle of the covariance of three rows."""
    at = 0
    for a in range(first, first + 3):
        for b in range(a, first + 3):
            out[at] = covariance_of(f, a, b)
            at += 1
