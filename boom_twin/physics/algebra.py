"""Small dense solves in place, for the blocks that a sweep condenses."""

from __future__ import annotations

from .jit import kernel

SMALLEST_PIVOT = 1e-300


@kernel
def condense(h, g, m, n):
    """Eliminate the last n of m + n unknowns of a symmetric system by L D L^T without pivoting.

    Parameters
    ----------
    h : ndarray, shape (>= m + n, >= m + n)
        Symmetric; the leading m rows and columns hold the condensed matrix afterwards, rows m.. the gains H_zz^-1 H_ze.
    g : ndarray, shape (>= m + n,)
        Likewise; g[m:] holds H_zz^-1 g_z afterwards.
    m, n : int

    Returns
    -------
    int
        Number of negative pivots; -1 if a pivot vanished.
    """
    negative = 0
    for k in range(m + n - 1, m - 1, -1):
        pivot = h[k, k]
        if not abs(pivot) > SMALLEST_PIVOT:
            return -1
        if pivot < 0.0:
            negative += 1
        for j in range(k):
            factor = h[k, j] / pivot
            for i in range(j + 1):
                h[j, i] -= factor * h[k, i]
            g[j] -= factor * g[k]
        for j in range(k):
            h[k, j] /= pivot
        g[k] /= pivot
    for k in range(m, m + n):
        for j in range(m, k):
            factor = h[k, j]
            for i in range(m):
                h[k, i] -= factor * h[j, i]
            g[k] -= factor * g[j]
    for j in range(m):
        for i in range(j):
            h[i, j] = h[j, i]
    return negative


@kernel
def solve(a, b, n, columns):
    """Solve a x = b in place by LU with row pivoting; a is (n, n), b is (n, columns) and becomes x. False if singular."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > SMALLEST_PIVOT:
            return False
        if best != k:
            for j in range(k, n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
            for j in range(columns):
                b[k, j], b[best, j] = b[best, j], b[k, j]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                for j in range(columns):
                    b[i, j] -= factor * b[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(columns):
            for i in range(k + 1, n):
                b[k, j] -= a[k, i] * b[i, j]
            b[k, j] /= a[k, k]
    return True
