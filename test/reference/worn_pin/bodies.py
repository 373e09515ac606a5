"""Bodies of the reference boom with a worn pin: what a cylinder lifts, and the cylinder itself.

Both have one coordinate, the heading phi of the section, and so inertia J(phi), its slope, and a pin whose place depends
on phi:     2 T = J phi'^2 ,     J = sum m |z'|^2 + I t'^2 .

About the pin, barrel and rod together have

I(l) = I_b + m_b a_b^2 + I_r + m_r (l - a_r)^2 ,      moment of mass = m_b a_b + m_r (l - a_r) .
"""

from __future__ import annotations

from cmath import exp
from collections.abc import Sequence
from dataclasses import dataclass

from .geometry import Document, Mass, Point, Turn, dot, links, on_left, on_right, rod_pin


@dataclass(frozen=True, slots=True)
class PlacedBodies:
    """A part at one heading: J and dJ/dphi (kg m^2), `moments` sum m z' (kg m), the bush.

    Times gravity, the moments are the weight's force on phi.
    """

    inertia: float
    slope: float
    moments: complex
    pin: Point


@dataclass(frozen=True)
class Turning:
    """A rigid body on a pivot; the body and `tip` in its own axes."""

    pivot: complex
    body: Mass
    tip: complex

    def tip_at(self, phi: float) -> complex:
        """Return the place of the tip, complex, m."""
        return self.pivot + self.tip * exp(1j * phi)


@dataclass(frozen=True)
class Lever(Turning):
    """A rigid body on a pivot with the bush on itself; `pin` in its own axes."""

    pin: complex

    def at(self, phi: float) -> PlacedBodies:
        """See `PlacedBodies`."""
        turn = Turn(phi, 1.0, 0.0)
        bodies = [(self.body, Point(self.pivot, 0j, 0j) + turn.arm(self.body.at), turn)]
        return _placed(bodies, Point(self.pivot, 0j, 0j) + turn.arm(self.pin))


@dataclass(frozen=True)
class SixBar(Turning):
    """A rigid body on a pivot of a fixed head with heading `before`, the bush on its linkage; `joint` as in a scene's file."""

    joint: Document
    before: float

    def at(self, phi: float) -> PlacedBodies:
        """See `PlacedBodies`."""
        joint, angle, turn = self.joint, phi - self.before, Turn(phi, 1.0, 0.0)
        left, right = links(joint, angle)
        long, short = joint["lL"], joint["lR"]
        one, other = joint.get("mL", 0.0), joint.get("mR", 0.0)
        bodies = [
            (self.body, Point(self.pivot, 0j, 0j) + turn.arm(self.body.at), turn),
            (Mass(one, one * long**2 / 12.0, 0j), self._fixed(on_left(joint, left, 0.5 * long)), left),
            (Mass(other, other * short**2 / 12.0, 0j), self._fixed(on_right(joint, angle, right, 0.5 * short)), right),
        ]
        return _placed(bodies, self._fixed(rod_pin(joint, angle, left, right)))

    def _fixed(self, point: Point) -> Point:
        return point.seen_from(self.pivot, self.before)


def _placed(bodies: Sequence[tuple[Mass, Point, Turn]], pin: Point) -> PlacedBodies:
    """`bodies`: mass, place and turn of each."""
    return PlacedBodies(
        sum(b.mass * abs(z.first) ** 2 + b.inertia * t.first**2 for b, z, t in bodies),
        2.0 * sum(b.mass * (z.first.conjugate() * z.second).real + b.inertia * t.first * t.second for b, z, t in bodies),
        sum(b.mass * z.first for b, z, _ in bodies),
        pin,
    )


@dataclass(frozen=True)
class OilCylinder:
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
        """Return the first moment of mass about the barrel pin, kg m."""
        return self.barrel_mass * self.barrel_com + self.rod_mass * (length - self.rod_com)

    def tension(self, length: float, rate: float, drive: tuple[float, float]) -> float:
        """Return the tension of the oil (N), at length and rate of the drive."""
        return self.k * (length - drive[0]) + self.d * (rate - drive[1])

    def holding(self, length: float, psi: float, tension: float, gravity: complex) -> complex:
        """Force (N, complex) on the rod's pin that holds the cylinder still at a tension of the oil."""
        u = exp(1j * psi)
        across = self.moment(length) / length * dot(gravity, 1j * u)
        return (tension - self.rod_mass * dot(gravity, u) - 1j * across) * u
