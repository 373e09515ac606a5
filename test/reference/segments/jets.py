"""Numbers with gradient and Hessian: automatic differentiation of plain geometry."""

from __future__ import annotations

import math

import numpy as np


class Jet:
    """Value v, gradient g (n,), Hessian h (n, n) of a function of n coordinates."""

    __slots__ = ("g", "h", "v")

    def __init__(self, v: float, g: np.ndarray, h: np.ndarray) -> None:
        self.v, self.g, self.h = v, g, h

    def __add__(self, other: Jet | float) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.v + other.v, self.g + other.g, self.h + other.h)
        return Jet(self.v + other, self.g, self.h)

    def __mul__(self, other: Jet | float) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.v * other, self.g * other, self.h * other)
        cross = np.outer(self.g, other.g)
        h = self.v * other.h + other.v * self.h + cross + cross.T
        return Jet(self.v * other.v, self.v * other.g + other.v * self.g, h)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Jet:
        return self * -1.0

    def __sub__(self, other: Jet | float) -> Jet:
        return self + -1.0 * other

    def through(self, value: float, first: float, second: float) -> Jet:
        """A function of this number, given its value and derivatives here."""
        return Jet(value, first * self.g, first * self.h + second * np.outer(self.g, self.g))


def coordinates(values: np.ndarray) -> list[Jet]:
    """One jet for each coordinate."""
    n = len(values)
    return [Jet(float(v), row, np.zeros((n, n))) for v, row in zip(values, np.eye(n), strict=True)]


def constant(value: float, n: int) -> Jet:
    """A jet that depends on nothing."""
    return Jet(float(value), np.zeros(n), np.zeros((n, n)))


def cos(a: Jet) -> Jet:
    """Cosine."""
    c, s = math.cos(a.v), math.sin(a.v)
    return a.through(c, -s, -c)


def sin(a: Jet) -> Jet:
    """Sine."""
    c, s = math.cos(a.v), math.sin(a.v)
    return a.through(s, c, -s)


def root(a: Jet) -> Jet:
    """Square root."""
    r = math.sqrt(a.v)
    return a.through(r, 0.5 / r, -0.25 / r**3)


def inverse(a: Jet) -> Jet:
    """Return 1 / a."""
    return a.through(1.0 / a.v, -1.0 / a.v**2, 2.0 / a.v**3)


def angle(x: Jet, y: Jet) -> Jet:
    """Angle of the vector (x, y), in (-pi, pi]."""
    r = math.hypot(x.v, y.v)
    c, s = x.v / r, y.v / r
    ahead, aside = x * c + y * s, y * c - x * s
    slope = aside * inverse(ahead)
    return slope.through(math.atan2(y.v, x.v), 1.0, 0.0)
