"""The finite-segment reference boom: rigid pieces with bending and axial springs, loops closed by constraints.

Coordinates: turn of an elastic base, heading of every section's root, headings of both links of every six-bar, and at each
spring a turn and a stretch. Everything else (points, energy, constraints) is written once as plain geometry on `jets`, which
give gradients and Hessians. Its error falls with the square of the number of springs.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from boom_twin import Scene
from boom_twin.scene.schema import Cylinder, Joint

from .geometry import gravity_in_base, half_segment, link_headings, pieces, pins, rigid_masses, spring_stiffness
from .jets import Jet, angle, constant, coordinates, cos, inverse, root, sin

Place = tuple[Jet, Jet]


@dataclass
class LumpedMass:
    """A mass (kg) at a point with an inertia (kg m^2) about it; x, y, turn are jets."""

    mass: float
    inertia: float
    x: Jet
    y: Jet
    turn: Jet


@dataclass
class SegmentBoom:
    """A boom at one set of coordinates."""

    tip: tuple[Jet, Jet, Jet]
    masses: list[LumpedMass] = field(default_factory=list)
    springs: list[tuple[float, float, Jet]] = field(default_factory=list)  # stiffness, damping, elongation
    closures: list[Jet] = field(default_factory=list)  # are zero
    lengths: list[Jet] = field(default_factory=list)  # of the cylinders
    joints: list[Jet] = field(default_factory=list)


class Segments:
    """A scene with about 4 `fineness` springs in every flexible section; 0 makes all sections rigid. Ideal pins."""

    def __init__(self, scene: Scene, fineness: int) -> None:
        self.scene, self.fineness = scene, fineness
        self.gravity = gravity_in_base(scene)

    def start(self, angles: np.ndarray) -> np.ndarray:
        """Coordinates of the undeformed boom at relative joint angles (rad)."""
        q: list[float] = [] if self.scene.base.stiffness is None else [0.0]
        heading = 0.0
        for i, relative in enumerate(angles):
            joint = self.scene.joints[i]
            before, heading = heading, heading + float(relative)
            q.append(heading)
            if joint.kind != "A":
                q += [before + link for link in link_headings(joint, float(relative))]
            q += [0.0] * (2 * sum(piece.springs for piece in pieces(self.scene, i, self.fineness)))
        return np.array(q)

    def lengths(self, angles: np.ndarray) -> np.ndarray:
        """Cylinder lengths (m) of the undeformed boom."""
        return np.array([length.v for length in self.place(self.start(angles)).lengths])

    def place(self, q: np.ndarray) -> SegmentBoom:
        """The boom at coordinates q."""
        jets, n = iter(coordinates(q)), len(q)
        base, (px, py) = self.scene.base, self.scene.base.pivot
        x, y, head = constant(px, n), constant(py, n), constant(0.0, n)
        boom = SegmentBoom((x, y, head))
        if base.stiffness is not None:
            head = next(jets)
            boom.springs.append((base.stiffness, base.damping or 0.0, head))
        pin = _point((x, y), head, base.cylinder_pin[0] - px, base.cylinder_pin[1] - py)
        for i, joint in enumerate(self.scene.joints):
            theta = next(jets)
            boom.joints.append(theta - head)
            if joint.kind != "A":
                rod = self._linkage(boom, joint, (x, y), head, theta, (next(jets), next(jets)))
                self._cylinder(boom, joint.cylinder, pin, rod)
            x, y, head, found = self._section(boom, i, x, y, theta, jets)
            if joint.kind == "A":
                self._cylinder(boom, joint.cylinder, pin, found["rod"])
            pin = found.get("C", pin)
        boom.tip = x, y, head
        if self.scene.tip is not None and self.scene.tip.payload:
            boom.masses.append(LumpedMass(self.scene.tip.payload, 0.0, x, y, head))
        return boom

    def _section(
        self, boom: SegmentBoom, i: int, x: Jet, y: Jet, theta: Jet, jets: Iterator[Jet]
    ) -> tuple[Jet, Jet, Jet, dict[str, Place]]:
        found: dict[str, Place] = {}
        parts = pieces(self.scene, i, self.fineness)
        for k, part in enumerate(parts):
            last = k == len(parts) - 1
            for name, (p, aside) in pins(self.scene, i).items():
                here = p < part.x1 - 1e-9 or last
                if name not in found and here and (p <= part.x0 + 1e-9 or part.springs == 0):
                    found[name] = _point((x, y), theta, p - part.x0, aside)
            if part.springs == 0:
                for body in rigid_masses(self.scene, i, part.x0, part.x1):
                    at = _point((x, y), theta, body.com[0] - part.x0, body.com[1])
                    boom.masses.append(LumpedMass(body.mass, body.inertia, *at, theta))
                x, y = _point((x, y), theta, part.x1 - part.x0, 0.0)
                continue
            x, y, theta = self._beam(boom, i, (part.x1 - part.x0) / part.springs, part.springs, (x, y), theta, jets)
        return x, y, theta, found

    def _beam(
        self, boom: SegmentBoom, i: int, h: float, springs: int, place: Place, theta: Jet, jets: Iterator[Jet]
    ) -> tuple[Jet, Jet, Jet]:
        """Half a piece, a spring, half a piece; as often as there are springs. Stretch is shared by both halves."""
        (x, y), beta = place, self.scene.sections[i].beta or 0.0
        mass, inertia = half_segment(self.scene, i, h)
        for _ in range(springs):
            turn, stretch = next(jets), next(jets)
            for stiffness, coordinate in zip(spring_stiffness(self.scene, i, h), (turn, stretch), strict=True):
                boom.springs.append((stiffness, beta * stiffness, coordinate))
            half = 0.5 * stretch + 0.5 * h
            for side in range(2):
                if side == 1:
                    theta = theta + turn
                c, s = cos(theta), sin(theta)
                boom.masses.append(LumpedMass(mass, inertia, x + 0.5 * half * c, y + 0.5 * half * s, theta))
                x, y = x + half * c, y + half * s
        return x, y, theta

    def _linkage(self, boom: SegmentBoom, joint: Joint, pivot: Place, head: Jet, theta: Jet, links: tuple[Jet, Jet]) -> Place:
        """Closure in pin Q, masses of the links; returns the rod pin."""
        assert joint.D and joint.E and joint.lL and joint.lR
        d, e = _point(pivot, head, *joint.D), _point(pivot, theta, *joint.E)
        left, right = _point(d, links[0], joint.lL, 0.0), _point(e, links[1], joint.lR, 0.0)
        boom.closures += [left[0] - right[0], left[1] - right[1]]
        for mass, length, start, turn in ((joint.mL, joint.lL, d, links[0]), (joint.mR, joint.lR, e, links[1])):
            if mass:
                boom.masses.append(LumpedMass(mass, mass * length**2 / 12, *_point(start, turn, 0.5 * length, 0.0), turn))
        along, aside = joint.R or (0.0, 0.0)
        if joint.kind == "B1":
            return left
        if joint.kind == "B2":
            return _point(d, links[0], along, aside)
        # B3: from Q along Q->E (against link R), and to the left of that direction
        return _point(right, links[1], -along, -aside)

    def _cylinder(self, boom: SegmentBoom, cylinder: Cylinder, pin: Place, rod: Place) -> None:
        dx, dy = rod[0] - pin[0], rod[1] - pin[1]
        length = root(dx * dx + dy * dy)
        boom.lengths.append(length)
        if cylinder.barrel is None and cylinder.rod is None:
            return
        ux, uy, turn = dx * inverse(length), dy * inverse(length), angle(dx, dy)
        for part, start, sign in ((cylinder.barrel, pin, 1.0), (cylinder.rod, rod, -1.0)):
            if part is not None:
                at = start[0] + sign * part.com * ux, start[1] + sign * part.com * uy
                boom.masses.append(LumpedMass(part.mass, part.inertia, *at, turn))


def _point(place: Place, theta: Jet, ahead: float, aside: float) -> Place:
    """Point at (ahead, aside) in axes turned by theta at `place`."""
    c, s = cos(theta), sin(theta)
    return place[0] + ahead * c - aside * s, place[1] + ahead * s + aside * c
