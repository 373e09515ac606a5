"""Geometry and masses of the finite-segment reference boom."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from boom_twin import Scene
from boom_twin.scene.schema import Cylinder, Joint, Point, RigidPart

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
