"""Plane rotations and small dense solves in place, for the blocks that a sweep condenses."""

from __future__ import annotations

import math

import numpy as np

from .jit import inner

SMALL = 0.5  # rad; up to here the series below are exact to rounding


@inner
def turned(angle, x, y):
    """Vector (x, y) turned by `angle` (rad)."""
    c, s = np.cos(angle), np.sin(angle)
    return c * x - s * y, s * x + c * y


@inner
def rotated(c, s, x, y):
    """Vector (x, y) turned by an angle of cosine c and sine s."""
    return c * x - s * y, s * x + c * y


@inner
def cosines(angles, count, turn):
    """Columns 0 and 1 of `turn` (>= count, >= 2): cosine and sine of the first `count` angles (rad).

    Below SMALL by Taylor series, whose remainders are below 1e-18 and 1e-19: bending turns little, and the library's
    functions were a fifth of a step.
    """
    largest = 0.0
    for j in range(count):
        largest = max(largest, abs(angles[j]))
    if not largest < SMALL:
        for j in range(count):
            turn[j, 0], turn[j, 1] = math.cos(angles[j]), math.sin(angles[j])
        return
    for j in range(count):
        x = angles[j]
        u = x * x
        c = 1.0 - u * (1.0 / 182.0)
        c = 1.0 - u * (1.0 / 132.0) * c
        c = 1.0 - u * (1.0 / 90.0) * c
        c = 1.0 - u * (1.0 / 56.0) * c
        c = 1.0 - u * (1.0 / 30.0) * c
        c = 1.0 - u * (1.0 / 12.0) * c
        s = 1.0 - u * (1.0 / 210.0)
        s = 1.0 - u * (1.0 / 156.0) * s
        s = 1.0 - u * (1.0 / 110.0) * s
        s = 1.0 - u * (1.0 / 72.0) * s
        s = 1.0 - u * (1.0 / 42.0) * s
        s = 1.0 - u * (1.0 / 20.0) * s
        turn[j, 0], turn[j, 1] = 1.0 - 0.5 * u * c, x - x * u * (1.0 / 6.0) * s


SMALLEST_PIVOT = 1e-300


@inner
def condense(s, p, coupling, block, force, m, n):
    """Eliminate n unknowns z from a symmetric system by L D L^T without pivoting.

    Parameters
    ----------
    s, p : ndarray, shapes (>= m, >= m), (>= m,)
        What remains: H_ee, g_e; condensed in place.
    coupling, block, force : ndarray, shapes (>= n, >= m), (>= n, >= n), (>= n,)
        H_ze, H_zz (lower triangle), g_z; coupling and force hold the gains H_zz^-1 H_ze, H_zz^-1 g_z afterwards.
    m, n : int

    Returns
    -------
    int
        Number of negative pivots; -1 if a pivot vanished.
    """
    negative = 0
    for k in range(n - 1, -1, -1):
        pivot = block[k, k]
        if not abs(pivot) > SMALLEST_PIVOT:
            return -1
        if pivot.real < 0.0:
            negative += 1
        inverse = 1.0 / pivot
        for j in range(k):
            factor = block[k, j] * inverse
            for i in range(j + 1):
                block[j, i] -= factor * block[k, i]
            for i in range(m):
                coupling[j, i] -= factor * coupling[k, i]
            force[j] -= factor * force[k]
        for j in range(m):
            factor = coupling[k, j] * inverse
            for i in range(j + 1):
                s[j, i] -= factor * coupling[k, i]
            p[j] -= factor * force[k]
        for j in range(k):
            block[k, j] *= inverse
        for j in range(m):
            coupling[k, j] *= inverse
        force[k] *= inverse
    for k in range(n):
        for j in range(k):
            factor = block[k, j]
            for i in range(m):
                coupling[k, i] -= factor * coupling[j, i]
            force[k] -= factor * force[j]
    for j in range(m):
        for i in range(j):
            s[i, j] = s[j, i]
    return negative


@inner
def condense_forces(p, coupling, block, force, m, n):
    """What `condense` does with p and force, by the gains and the factors that it left in coupling and block."""
    for k in range(n):
        for j in range(m):
            p[j] -= coupling[k, j] * force[k]
    for k in range(n - 1, -1, -1):
        for j in range(k):
            force[j] -= block[k, j] * force[k]
        force[k] /= block[k, k]
    for k in range(n):
        for j in range(k):
            force[k] -= block[k, j] * force[j]


@inner
def factorise(a, n, order):
    """LU with row pivoting in place of a, shape (>= n, >= n); `order` notes which row each was exchanged with.

    False if singular.
    """
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[best, k]):
                best = i
        if not abs(a[best, k]) > SMALLEST_PIVOT:
            return False
        order[k] = best
        if best != k:
            for j in range(k, n):
                a[k, j], a[best, j] = a[best, j], a[k, j]
        inverse = 1.0 / a[k, k]
        a[k, k] = inverse
        for i in range(k + 1, n):
            factor = a[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
    return True


@inner
def substitute(a, order, b, n, columns):
    """Solve with what `factorise` left in `a` and `order`: b, shape (>= n, >= columns), becomes the solution."""
    for k in range(n):
        best = order[k]
        if best != k:
            for j in range(columns):
                b[k, j], b[best, j] = b[best, j], b[k, j]
        for i in range(k + 1, n):
            factor = a[i, k] * a[k, k]
            if factor != 0.0:
                for j in range(columns):
                    b[i, j] -= factor * b[k, j]
    for k in range(n - 1, -1, -1):
        for i in range(k + 1, n):
            factor = a[k, i]
            for j in range(columns):
                b[k, j] -= factor * b[i, j]
        inverse = a[k, k]
        for j in range(columns):
            b[k, j] *= inverse


@inner
def solve(a, b, n, columns, order):
    """Solve a x = b in place by LU with row pivoting; a is (n, n), b is (n, columns) and becomes x. False if singular."""
    if not factorise(a, n, order):
        return False
    substitute(a, order, b, n, columns)
    return True
