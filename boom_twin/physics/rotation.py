"""Turned vectors, and cosine and sine of many small angles."""

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
