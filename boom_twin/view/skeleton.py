"""Where every pin of an undeformed boom is: pure geometry, for drawing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..physics.linkage import LINK_L, link_angles
from ..physics.rotation import turned
from ..records import Array
from ..scene.kinematics import linkage
from ..scene.parts import Scene


@dataclass(frozen=True)
class JointPins:
    """Pins of one joint in the model frame, m, each shape (2,); D, E, Q are None for kind A."""

    kind: str
    pivot: Array
    barrel_pin: Array
    rod_pin: Array
    d: Array | None = None
    e: Array | None = None
    q: Array | None = None

    @property
    def links(self) -> list[list[Array]]:
        """Corners of link L and of link R; three where the rod pin is on that link beside its ends."""
        if self.d is None or self.e is None or self.q is None:
            return []
        left, right = [self.d, self.q], [self.e, self.q]
        if self.kind == "B2":
            left.append(self.rod_pin)
        if self.kind == "B3":
            right.append(self.rod_pin)
        return [left, right]


@dataclass(frozen=True)
class Skeleton:
    """An undeformed boom of n sections.

    Attributes
    ----------
    headings : ndarray, shape (n,)
        Orientation of every section, rad.
    pivots : ndarray, shape (n + 1, 2)
        Inboard pivots, then the tip, m.
    joints : tuple of JointPins
    """

    headings: Array
    pivots: Array
    joints: tuple[JointPins, ...]

    def point(self, section: int, x: float, y: float = 0.0) -> Array:
        """A point given in the axes of `section` (0-based), m, in the model frame."""
        return placed(self.pivots[section], float(self.headings[section]), (x, y))


def placed(origin: Array, heading: float, point: tuple[float, float]) -> Array:
    """`point` of a frame at `origin` turned by `heading` (rad), shape (2,)."""
    return np.asarray(origin + np.array(turned(heading, point[0], point[1])))


def skeleton(scene: Scene, angles: Array) -> Skeleton:
    """Pins of the undeformed boom at relative joint `angles` (rad), shape (n,)."""
    headings = np.cumsum(angles)
    lengths = np.array([section.length for section in scene.sections])
    steps = np.stack([lengths * np.cos(headings), lengths * np.sin(headings)], axis=1)
    pivots = np.array(scene.base.pivot) + np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
    joints = tuple(_pins(scene, i, pivots[i], headings) for i in range(len(headings)))
    return Skeleton(headings, pivots, joints)


def _pins(scene: Scene, i: int, pivot: Array, headings: Array) -> JointPins:
    row, carrier = linkage(scene, i), float(headings[i - 1]) if i else 0.0
    phi = float(headings[i]) - carrier
    barrel_pin = placed(pivot, carrier, (row.cx, row.cy))
    if scene.joints[i].kind == "A":
        return JointPins("A", pivot, barrel_pin, placed(pivot, carrier + phi, (row.ex, row.ey)))
    d, e = placed(pivot, carrier, (row.dx, row.dy)), placed(pivot, carrier + phi, (row.ex, row.ey))
    left, right = link_angles(row, phi)
    q = d + row.length_l * np.array([math.cos(carrier + left), math.sin(carrier + left)])
    base, angle = (d, left) if row.mount == LINK_L else (e, right)
    rod_pin = placed(base, carrier + angle, (row.along, row.left))
    return JointPins(scene.joints[i].kind, pivot, barrel_pin, rod_pin, d, e, q)
