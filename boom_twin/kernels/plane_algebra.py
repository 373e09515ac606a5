"""Plane rotations and small dense solves in place, for the blocks that a sweep condenses."""

from __future__ import annotations

import math

import numpy as np

from .jit import inner

COS, SIN = 0, 1  # rows of a table of turns

# Cosine and sine on [-pi/4, pi/4]: the polynomials of fdlibm (k_cos.c, k_sin.c). pi/2 in three parts, the first two of 33 bits.
QUARTER, FAR = 0.25 * math.pi, 1e5
HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
C1, C2, C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
C4, C5, C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
S1, S2, S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
S4, S5, S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10


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
def near_zero(x):
    """Cosine and sine of an angle in [-pi/4, pi/4] (rad), to one unit in the last place."""
    u = x * x
    v = u * u
    c = (C1 + u * C2) + v * ((C3 + u * C4) + v * (C5 + u * C6))
    s = (S1 + u * S2) + v * ((S3 + u * S4) + v * (S5 + u * S6))
    return 1.0 - (0.5 * u - v * c), x + x * u * s


@inner
def cosine_and_sine(x):
    """Cosine and sine of an angle (rad), to one unit in the last place of 1; the library's two calls were a fifth of a step."""
    quarters = np.floor(x * (2.0 / math.pi) + 0.5)
    c, s = near_zero(((x - quarters * HALF_PI[0]) - quarters * HALF_PI[1]) - quarters * HALF_PI[2])
    quadrant = quarters - 4.0 * np.floor(0.25 * quarters)
    odd, behind = (quadrant == 1.0) | (quadrant == 3.0), quadrant >= 2.0
    c, s = (-s, c) if odd else (c, s)
    c, s = (-c, -s) if behind else (c, s)
    if abs(x) >= FAR:
        return math.cos(x), math.sin(x)
    return c, s


@inner
def cosines(angles, count, turn):
    """Rows COS and SIN of `turn` (>= 2, >= count): of the first `count` angles (rad)."""
    largest = 0.0
    for j in range(count):
        largest = max(largest, abs(angles[j]))
    if not largest >= QUARTER:
        for j in range(count):
            turn[COS, j], turn[SIN, j] = near_zero(angles[j])
        return
    for j in range(count):
        turn[COS, j], turn[SIN, j] = cosine_and_sine(angles[j])


SMALLEST_PIVOT = 1e-300


@inner
def condense(s, p, coupling, block, force, m, n):
    """Eliminate n unknowns z from a symmetric system by L D L^T without pivoting.

    What remains, `s` (>= m, >= m) and `p` (>= m,), is H_ee and g_e; condensed in place. `coupling` (>= n, >= m), `block` (>=
    n, >= n) and `force` (>= n,) are H_ze, H_zz (lower triangle) and g_z. Afterwards coupling and force hold the gains H_zz^-1
    H_ze and H_zz^-1 g_z, block the factors L and 1/D. Return the number of negative pivots; -1 if a pivot vanished.
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
        block[k, k] = inverse
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
    """Condense p and force as `condense` does, by the gains and the factors that it left in coupling and block."""
    for j in range(m):
        value = p[j]
        for k in range(n):
            value -= coupling[k, j] * force[k]
        p[j] = value
    for k in range(n - 1, -1, -1):
        for j in range(k):
            force[j] -= block[k, j] * force[k]
        force[k] *= block[k, k]
    for k in range(n):
        for j in range(k):
            force[k] -= block[k, j] * force[j]


@inner
def exchange(a, k, best, first, last):
    """Exchange rows k and `best` of a in columns `first` .. `last - 1`."""
    if best != k:
        for j in range(first, last):
            a[k, j], a[best, j] = a[best, j], a[k, j]


@inner
def factorise(a, n, order):
    """LU with row pivoting in place of a, shape (>= n, >= n); `order` notes which row each was exchanged with.

    False if singular.
    """
    for k in range(n):
        best, largest = k, abs(a[k, k])
        for i in range(k + 1, n):
            size = abs(a[i, k])
            if size > largest:
                best, largest = i, size
        if not largest > SMALLEST_PIVOT:
            return False
        order[k] = best
        exchange(a, k, best, k, n)
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
        exchange(b, k, order[k], 0, columns)
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
