"""What a cylinder lifts: one rigid body on a pivot, directly (joint A) or through the links of a six-bar (B1, B2, B3).

Both have one coordinate, the heading phi of the section, and so inertia J(phi), its slope, and a pin whose place depends
on phi:     2 T = J phi'^2 ,     J = sum m |z'|^2 + I t'^2 .
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .linkage import links, on_left, on_right, rod_pin
from .moving import Document, Mass, Point, Turn


@dataclass(frozen=True, slots=True)
class Placed:
    """A part at one heading.

    Attributes
    ----------
    inertia, slope : float
        J and dJ/dphi, kg m^2.
    moments : complex
        sum m z', kg m: times gravity, the weight's force on phi.
    height : complex
        sum m z, kg m.
    pin : Point
        The bush.
    """

    inertia: float
    slope: float
    moments: complex
    height: complex
    pin: Point


@dataclass(frozen=True)
class Lever:
    """A rigid body on a pivot with the bush on itself; `pin`, `tip` and the body in its own axes."""

    pivot: complex
    body: Mass
    pin: complex
    tip: complex

    def at(self, phi: float) -> Placed:
        """See `Placed`."""
        turn = Turn(phi, 1.0, 0.0)
        bodies = [(self.body, Point(self.pivot, 0j, 0j) + turn.arm(self.body.at), turn)]
        return _placed(bodies, Point(self.pivot, 0j, 0j) + turn.arm(self.pin))

    def tip_at(self, phi: float) -> complex:
        """Complex, m."""
        return self.pivot + Turn(phi, 1.0, 0.0).arm(self.tip).value


@dataclass(frozen=True)
class SixBar:
    """A rigid body on a pivot of a fixed head with heading `before`, the bush on its linkage; `joint` as in a scene's file."""

    pivot: complex
    body: Mass
    joint: Document
    before: float
    tip: complex

    def at(self, phi: float) -> Placed:
        """See `Placed`."""
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

    def tip_at(self, phi: float) -> complex:
        """Complex, m."""
        return self.pivot + Turn(phi, 1.0, 0.0).arm(self.tip).value

    def _fixed(self, point: Point) -> Point:
        return point.seen_from(self.pivot, self.before)


def _placed(bodies: Sequence[tuple[Mass, Point, Turn]], pin: Point) -> Placed:
    """`bodies`: mass, place and turn of each."""
    return Placed(
        sum(b.mass * abs(z.first) ** 2 + b.inertia * t.first**2 for b, z, t in bodies),
        2.0 * sum(b.mass * (z.first.conjugate() * z.second).real + b.inertia * t.first * t.second for b, z, t in bodies),
        sum(b.mass * z.first for b, z, _ in bodies),
        sum(b.mass * z.value for b, z, _ in bodies),
        pin,
    )
