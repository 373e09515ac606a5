"""Monotone piecewise cubic through given rows: once continuously differentiable, never beyond its rows.

The slopes are those of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984), at inner rows a weighted harmonic mean of the
two neighbouring secants, zero where they differ in sign; at the ends a parabola through three rows, held back where it would
overshoot. `scipy.interpolate.PchipInterpolator` gives the same, but takes longer to import than all that `simulate` does.
"""

from __future__ import annotations

import numpy as np

from ..records import Array


def pchip(x: Array, y: Array, at: Array) -> tuple[Array, Array]:
    """The curve and its derivative at places `at`.

    Parameters
    ----------
    x : ndarray, shape (m,)
        Increasing, at least two.
    y : ndarray, shape (m, n)
        Rows, one curve a column.
    at : ndarray, shape (k,)
        Within x[0] to x[-1].

    Returns
    -------
    values, derivatives : ndarray, shape (k, n)
    """
    h = np.diff(x)[:, None]
    secant = np.diff(y, axis=0) / h
    slope = _slopes(h, secant)
    i = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
    s, h, secant, left, right = (at - x[i])[:, None], h[i], secant[i], slope[i], slope[i + 1]
    square = (3.0 * secant - 2.0 * left - right) / h
    cube = (left + right - 2.0 * secant) / h**2
    return y[i] + s * (left + s * (square + s * cube)), left + s * (2.0 * square + s * 3.0 * cube)


def _slopes(h: Array, secant: Array) -> Array:
    """Derivatives at all rows, (m, n), from spacings (m - 1, 1) and secants (m - 1, n)."""
    if len(h) == 1:
        return np.repeat(secant, 2, axis=0)
    before, after = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    alike = secant[:-1] * secant[1:] > 0.0
    first, second = np.where(alike, secant[:-1], 1.0), np.where(alike, secant[1:], 1.0)
    inner = np.where(alike, (before + after) / (before / first + after / second), 0.0)
    start = _end(h[0], h[1], secant[0], secant[1])
    stop = _end(h[-1], h[-2], secant[-1], secant[-2])
    return np.vstack([start, inner, stop])


def _end(near: Array, far: Array, first: Array, second: Array) -> Array:
    """Derivative at an end, (n,), from the spacings and secants next to it."""
    slope = ((2.0 * near + far) * first - near * second) / (near + far)
    turned, steep = slope * first <= 0.0, (first * second < 0.0) & (np.abs(slope) > 3.0 * np.abs(first))
    return np.asarray(np.where(turned, 0.0, np.where(steep, 3.0 * first, slope)))
