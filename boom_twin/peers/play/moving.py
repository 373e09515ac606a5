"""Bodies and points whose places depend on one angle, with two derivatives by it; the plane is complex."""

from __future__ import annotations

from cmath import exp
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

Document = dict[str, Any]  # a scene's file, or a part of it


@dataclass(frozen=True)
class Mass:
    """A rigid body in some axes: kg, kg m^2 about its centre, the centre (complex, m)."""

    mass: float
    inertia: float
    at: complex


@dataclass(frozen=True, slots=True)
class Point:
    """A place (m) and its derivatives by the angle."""

    value: complex
    first: complex
    second: complex

    def __add__(self, other: Point) -> Point:
        return Point(self.value + other.value, self.first + other.first, self.second + other.second)

    def seen_from(self, origin: complex, heading: float) -> Point:
        """In axes where this point's own stand at `origin`, turned by `heading`."""
        turn = exp(1j * heading)
        return Point(origin + turn * self.value, turn * self.first, turn * self.second)


@dataclass(frozen=True, slots=True)
class Turn:
    """A heading (rad) and its derivatives by the angle."""

    value: float
    first: float
    second: float

    def arm(self, local: complex) -> Point:
        """The vector `local` (complex, m) carried by this heading."""
        arm = local * exp(1j * self.value)
        return Point(arm, 1j * self.first * arm, (1j * self.second - self.first**2) * arm)


def lumped(masses: Sequence[Mass]) -> Mass:
    """One rigid body of many that do not move against each other."""
    mass = sum(body.mass for body in masses)
    at = sum(body.mass * body.at for body in masses) / mass
    return Mass(mass, sum(body.inertia + body.mass * abs(body.at - at) ** 2 for body in masses), at)


def dot(a: complex, b: complex) -> float:
    """Scalar product of two vectors of the plane."""
    return a.real * b.real + a.imag * b.imag
