"""Contact law of a worn pin for the reference models: force over penetration and its rate.

F = K d^n (1 + chi g' / v_in) >= 0 ,      d = (g + sqrt(g^2 + eps^2)) / 2 ,      g = |offset| - c

K, internal contact of cylinders [R]: K = 4/[3(s_i + s_j)] sqrt(R_i R_j / (R_j - R_i)), s = (1 - nu^2)/E, R_j = R_i + c.
chi: Lankarani and Nikravesh (1990); Flores et al. (2011); Hunt and Crossley (1975); Hertz has none.
[R] is Ren et al. 2014, doi 10.1155/2014/943847. Vectors of the plane are complex numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, log1p, sqrt

from scipy.optimize import brentq


def keeping(restitution: float) -> float:
    """Return chi with which an impact keeps the share e of its speed: chi (1 + e) = log[(1 + chi)/(1 - chi e)]."""

    def excess(chi: float) -> float:
        return chi * (1.0 + restitution) - log1p(chi) + log1p(-chi * restitution)

    most = (1.0 - 1e-15) / restitution
    if restitution == 1.0 or excess(most) > 0.0:
        return 0.0 if restitution == 1.0 else most
    return float(brentq(excess, 0.5 * (1.0 - restitution), most))


HYSTERESIS: dict[str, Callable[[float], float]] = {
    "hertz": lambda e: 0.0,
    "lankarani-nikravesh": lambda e: 3.0 * (1.0 - e**2) / 4.0,
    "flores": lambda e: 8.0 * (1.0 - e) / (5.0 * e),
    "hunt-crossley": lambda e: 3.0 * (1.0 - e) / 2.0,
    "hunt-crossley-exact": keeping,
}
"""chi over the restitution that the law is meant to give."""


def stiffness(pin_radius: float, clearance: float, young: float, poisson: float) -> float:
    """Return K (N/m^1.5) of pin and bush of one material; m, Pa."""
    softness = 2.0 * (1.0 - poisson**2) / young
    return 4.0 / (3.0 * softness) * sqrt(pin_radius * (pin_radius + clearance) / clearance)


@dataclass(frozen=True)
class Contact:
    """A pin in a bush, without friction."""

    stiffness: float  # K, N/m^n
    hysteresis: float  # chi
    clearance: float  # c, radial, m
    exponent: float = 1.5  # n
    smoothing: float = 0.0  # eps, m; 0 is the sharp gap

    def gap(self, offset: complex) -> float:
        """Return the gap |offset| - c, m: negative in flight."""
        return abs(offset) - self.clearance

    def penetration(self, gap: float) -> float:
        """Return the penetration d, m."""
        if self.smoothing == 0.0:
            return max(gap, 0.0)
        long = hypot(gap, self.smoothing)
        return 0.5 * (gap + long) if gap > 0.0 else 0.5 * self.smoothing**2 / (long - gap)

    def normal(self, gap: float, gap_rate: float, entry: float | None) -> float:
        """Return F, N. `entry`: approach speed (m/s) when the pin touched, or None in flight, where nothing is damped."""
        depth = self.penetration(gap)
        elastic = float(self.stiffness * depth**self.exponent)
        if entry is None or depth == 0.0:
            return elastic
        return max(elastic * (1.0 + self.hysteresis * gap_rate / max(entry, 1e-3)), 0.0)  # 1 mm/s at least

    def force(self, offset: complex, rate: complex, entry: float | None) -> complex:
        """Return the force (N) of the bush on the pin, complex; offset (m) and rate (m/s) of the pin against the bush."""
        distance = abs(offset)
        if distance == 0.0:
            return 0j
        outward = offset / distance
        along = rate * outward.conjugate()
        pressure = self.normal(distance - self.clearance, along.real, entry)
        return complex(-pressure * outward)

    def resting_offset(self, force: complex) -> complex:
        """Return the offset (m) of a pin at rest that presses on the bush with `force` (N, complex, not 0), along the force."""
        size = abs(force)
        depth = (size / self.stiffness) ** (1.0 / self.exponent)
        return complex((self.clearance + depth - 0.25 * self.smoothing**2 / depth) * force / size)
