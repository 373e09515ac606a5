"""Geometry and masses of the finite-segment reference boom."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from boom_twin import Scene
from boom_twin.scene.schema import Cylinder, CylinderPart, Joint, Point, RigidPart


class Bodies:
    """Bodies of a scene: first all links L, then all links R, barrels, rods.

    Attributes
    ----------
    mass, inertia : ndarray, shape (2 (n - 1) + 2 n,)
        kg, kg m^2.
    left_middle, right_middle : ndarray, shape (n - 1,)
        Centre of a link, m along it from its own pin.
    barrel, rod : ndarray, shape (n,)
        Centre of barrel and rod, m from their pins.
    on_left : list of bool
        Whether the rod is pinned to link L.
    rod_ahead, rod_aside : ndarray, shape (n - 1,)
        Where, m along and to the left of that link.
    """

    def __init__(self, scene: Scene) -> None:
        six_bars, cylinders = scene.joints[1:], [joint.cylinder for joint in scene.joints]
        self.left_middle = np.array([0.5 * (joint.lL or 0.0) for joint in six_bars])
        self.right_middle = np.array([0.5 * (joint.lR or 0.0) for joint in six_bars])
        self.on_left = [joint.kind != "B3" for joint in six_bars]
        self.rod_ahead, self.rod_aside = np.array([_rod_pin(joint) for joint in six_bars]).reshape(-1, 2).T
        barrels = [_cylinder_part(cylinder.barrel) for cylinder in cylinders]
        rods = [_cylinder_part(cylinder.rod) for cylinder in cylinders]
        self.barrel, self.rod = np.array([part[2] for part in barrels]), np.array([part[2] for part in rods])
        links = [(joint.mL or 0.0, (joint.mL or 0.0) * (joint.lL or 0.0) ** 2 / 12) for joint in six_bars]
        links += [(joint.mR or 0.0, (joint.mR or 0.0) * (joint.lR or 0.0) ** 2 / 12) for joint in six_bars]
        self.mass, self.inertia = np.array([*links, *(part[:2] for part in (*barrels, *rods))]).T


def _rod_pin(joint: Joint) -> tuple[float, float]:
    """Return the rod pin on link L from D (B1, B2), or on link R from E (B3), in m along and to the left."""
    along, aside = joint.R or (0.0, 0.0)
    if joint.kind == "B1":
        return joint.lL or 0.0, 0.0
    return (along, aside) if joint.kind == "B2" else ((joint.lR or 0.0) - along, -aside)


def _cylinder_part(part: CylinderPart | None) -> tuple[float, float, float]:
    """Mass, inertia, distance of the centre from the pin; a part that is not there weighs nothing."""
    return (0.0, 0.0, 0.0) if part is None else (part.mass, part.inertia, part.com)


@dataclass(frozen=True)
class Angles:
    """Heading of a link against the head before, and its derivatives by the joint angle; each of shape (joints,)."""

    value: np.ndarray
    first: np.ndarray
    second: np.ndarray


class Linkages:
    """All six-bars of a boom, kinds B1 to B3."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.d = np.array([complex(*joint.D) for joint in joints if joint.D])
        self.e = np.array([complex(*joint.E) for joint in joints if joint.E])
        self.left = np.array([joint.lL for joint in joints], dtype=float)
        self.right = np.array([joint.lR for joint in joints], dtype=float)
        self.side = np.array([_side(joint) for joint in joints])

    def angles(self, phi: np.ndarray) -> tuple[Angles, Angles]:
        """Links L (from D) and R (from E) at joint angles `phi` (rad), shape (joints,).

        The diagonal D->E has length r and heading a; by the law of cosines L is turned from it by an angle that depends on
        r alone, and R from its reverse likewise.
        """
        turned = self.e * np.exp(1j * phi)
        gap, rate = turned - self.d, 1j * turned
        square = np.abs(gap) ** 2
        inner, bend = np.conj(gap) * rate, -np.conj(gap) * turned
        u1, u2 = 2.0 * inner.real, 2.0 * (np.abs(rate) ** 2 + bend.real)
        r = np.sqrt(square)
        r1 = u1 / (2.0 * r)
        span = Angles(r, r1, u2 / (2.0 * r) - r1**2 / r)
        a = Angles(np.angle(gap), inner.imag / square, bend.imag / square - inner.imag * u1 / square**2)
        left, right, side = _opening(span, self.left, self.right), _opening(span, self.right, self.left), self.side
        return (
            Angles(a.value + side * left.value, a.first + side * left.first, a.second + side * left.second),
            Angles(a.value + np.pi - side * right.value, a.first - side * right.first, a.second - side * right.second),
        )


def _opening(span: Angles, own: np.ndarray, other: np.ndarray) -> Angles:
    """Angle between the diagonal and the link of length `own` (m), over the joint angle."""
    r, excess = span.value, own**2 - other**2
    cosine = (r + excess / r) / (2.0 * own)
    by_r, by_rr = (1.0 - excess / r**2) / (2.0 * own), excess / (own * r**3)
    sine = np.sqrt(1.0 - cosine**2)
    slope = -by_r / sine
    curvature = -(by_rr + cosine * slope**2) / sine
    return Angles(np.arccos(cosine), slope * span.first, curvature * span.first**2 + slope * span.second)


SPRINGS = 4  # per flexible section and unit of fineness, about
SAME_PLACE = 1e-9  # m


@dataclass(frozen=True)
class Piece:
    """A stretch of a section from x0 to x1 (m from its inboard pivot): rigid, or with a number of springs."""

    x0: float
    x1: float
    springs: int


def pieces(scene: Scene, index: int, fineness: int) -> list[Piece]:
    """Pieces of section `index` (0-based), inboard to outboard; pins sit on their borders or on rigid ones."""
    section = scene.sections[index]
    if section.beam is None or not scene.is_flexible(index) or fineness == 0:
        return [Piece(0.0, section.length, 0)]
    x0, x1 = section.beam
    inside = sorted({p for p, _ in pins(scene, index).values() if x0 + SAME_PLACE < p < x1 - SAME_PLACE})
    parts = [Piece(a, b, fineness * max(1, round(SPRINGS * (b - a) / (x1 - x0)))) for a, b in pairwise([x0, *inside, x1])]
    return [Piece(0.0, x0, 0), *parts, Piece(x1, section.length, 0)]


def pins(scene: Scene, index: int) -> dict[str, Point]:
    """Pins of cylinders on section `index`: "rod" of cylinder 1, "C" of the next one; (x, y) from the inboard pivot."""
    section, found = scene.sections[index], dict[str, Point]()
    if index == 0 and section.rod_pin is not None:
        found["rod"] = section.rod_pin
    if index + 1 < len(scene.joints):
        c = scene.joints[index + 1].C
        assert c is not None
        found["C"] = (section.length + c[0], c[1])
    return found


def rigid_masses(scene: Scene, index: int, x0: float, x1: float) -> list[RigidPart]:
    """Return the rigid parts of a stretch of section `index` that have mass; centres in the axes of the section.

    They are the named part that belongs to it, the beam if it does not bend, and the line's fill.
    """
    section, fill = scene.sections[index], scene.line_fill or 0.0
    whole = x1 - x0 == section.length
    ends = (section.root, whole or x0 == 0.0), (section.head, whole or x0 > 0.0)
    found = [_rod(fill, 0.0, x0, x1)]
    if whole and section.beam is not None:
        found.append(_rod(section.rho_A or 0.0, section.rho_I or 0.0, *section.beam))
    found += [part for part, here in ends if part is not None and here]
    return [part for part in found if part.mass > 0.0 or part.inertia > 0.0]


def half_segment(scene: Scene, index: int, length: float) -> tuple[float, float]:
    """Mass (kg) and inertia (kg m^2) of one half of a spring's stretch of `length` (m)."""
    section = scene.sections[index]
    assert section.rho_A is not None
    mass = 0.5 * length * (section.rho_A + (scene.line_fill or 0.0))
    return mass, mass * (0.5 * length) ** 2 / 12 + 0.5 * length * (section.rho_I or 0.0)


def spring_stiffness(scene: Scene, index: int, length: float) -> tuple[float, float]:
    """Stiffness of a spring in bending (N m/rad) and in stretch (N/m)."""
    section, elastic = scene.sections[index], scene.material.E
    assert section.I is not None and section.A is not None
    return elastic * section.I / length, elastic * section.A / length


def gravity_in_base(scene: Scene) -> np.ndarray:
    """Gravity (m/s^2), shape (2,), in the axes of the base."""
    turn, (gx, gy) = -scene.base.inclination, scene.gravity
    return np.array([math.cos(turn) * gx - math.sin(turn) * gy, math.sin(turn) * gx + math.cos(turn) * gy])


def link_headings(joint: Joint, relative: float) -> tuple[float, float]:
    """Angles of links L and R against the head before, for a relative joint angle."""
    assert joint.D is not None and joint.E is not None and joint.lL is not None and joint.lR is not None
    d = complex(*joint.D)
    e = complex(*joint.E) * np.exp(1j * relative)
    gap = e - d
    along = (joint.lL**2 - joint.lR**2 + abs(gap) ** 2) / (2.0 * abs(gap))
    q = d + gap / abs(gap) * complex(along, _side(joint) * math.sqrt(joint.lL**2 - along**2))
    return float(np.angle(q - d)), float(np.angle(q - e))


def _side(joint: Joint) -> float:
    """Return 1 where pin Q lies left of D->E, -1 where it lies right of it."""
    return {"left": 1.0, "right": -1.0}[joint.side or "left"]


def oil_stiffness(cylinder: Cylinder, length: float) -> float:
    """Stiffness (N/m) of the oil spring of a drive that is `length` (m) long; 0 of an incompressible cylinder."""
    if cylinder.oil is None:
        return cylinder.k or 0.0
    oil, stroke = cylinder.oil, length - cylinder.closed_length
    cap, rod = 0.25 * math.pi * oil.bore**2, 0.25 * math.pi * (oil.bore - oil.rod) * (oil.bore + oil.rod)
    volumes = oil.cap_line + cap * stroke, oil.rod_line + rod * (cylinder.max_stroke - stroke)
    return oil.bulk_modulus * (cap**2 / volumes[0] + rod**2 / volumes[1])


def _rod(density: float, turning: float, a: float, b: float) -> RigidPart:
    """A thin rod of `density` (kg/m) with rotary inertia `turning` (kg m) from a to b."""
    mass = density * (b - a)
    return RigidPart(mass=mass, com=(0.5 * (a + b), 0.0), inertia=mass * (b - a) ** 2 / 12 + turning * (b - a))
