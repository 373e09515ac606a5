"""A hydraulic cylinder on a fixed barrel pin: oil spring and damper between two rigid bodies on one line.

About the pin, barrel and rod together have

    I(l) = I_b + m_b a_b^2 + I_r + m_r (l - a_r)^2 ,      moment of mass = m_b a_b + m_r (l - a_r) .
"""

from __future__ import annotations

from cmath import exp
from dataclasses import dataclass

from .moving import dot


@dataclass(frozen=True)
class Cylinder:
    """Barrel pin (complex, m), oil spring (N/m) and damper (N s/m), barrel and rod (kg, kg m^2, m from their own pins)."""

    pin: complex
    k: float
    d: float
    barrel_mass: float
    barrel_inertia: float
    barrel_com: float
    rod_mass: float
    rod_inertia: float
    rod_com: float

    def inertia(self, length: float) -> float:
        """I about the barrel pin, kg m^2."""
        still = self.barrel_inertia + self.barrel_mass * self.barrel_com**2 + self.rod_inertia
        return still + self.rod_mass * (length - self.rod_com) ** 2

    def moment(self, length: float) -> float:
        """Of mass about the barrel pin, kg m."""
        return self.barrel_mass * self.barrel_com + self.rod_mass * (length - self.rod_com)

    def tension(self, length: float, rate: float, drive: tuple[float, float]) -> float:
        """Of the oil (N), at length and rate of the drive."""
        return self.k * (length - drive[0]) + self.d * (rate - drive[1])

    def energy(self, length: float, psi: float, rate: float, swing: float, drive: float, gravity: complex) -> float:
        """Of motion, oil and weight, J, at a length of the drive."""
        moving = self.rod_mass * rate**2 + self.inertia(length) * swing**2
        return 0.5 * moving + 0.5 * self.k * (length - drive) ** 2 - dot(gravity, self.moment(length) * exp(1j * psi))

    def holding(self, length: float, psi: float, tension: float, gravity: complex) -> complex:
        """Force (N, complex) on the rod's pin that holds the cylinder still at a tension of the oil."""
        u = exp(1j * psi)
        across = self.moment(length) / length * dot(gravity, 1j * u)
        return (tension - self.rod_mass * dot(gravity, u) - 1j * across) * u
