"""Six-bar linkage of a B joint: frames of its links and positions of its pins."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ....scene.schema import Point, Scene
from ....types import Array
from .masses import Lump
from .system import Frame


@dataclass(frozen=True, slots=True)
class Link:
    """A link as a uniform rod, with its frame at its middle."""

    mass: float  # kg
    length: float  # m
    frame: Frame
    apex: Point  # pin shared with the other link, m, in the axes of the link
    outer: Point  # pin on the section

    @property
    def lump(self) -> Lump:
        """Return mass and moment of inertia of the link."""
        return Lump(self.mass, (0.0, 0.0), self.mass * self.length**2 / 12)


@dataclass(frozen=True, slots=True)
class SixBar:
    """Both links and the cylinder's pins."""

    left: Link
    right: Link
    bears_right: bool  # True if the right link bears the rod pin
    rod_pin: Point  # m, in the axes of the link that bears it
    bracket: Point  # barrel pin, m, in the axes of the section before the joint
    hinge: Point  # pin of the left link there
    turned_hinge: Point  # pin of the right link, m, in the axes of the section that the joint turns

    @property
    def bearing(self) -> Link:
        """Return the link that bears the rod pin."""
        return self.right if self.bears_right else self.left

    @property
    def two_force(self) -> Link:
        """Return the link without the rod pin."""
        return self.left if self.bears_right else self.right


def six_bar(scene: Scene, frames: list[Frame], index: int) -> SixBar:
    """Return the linkage of joint `index` (0-based) between undeformed sections at `frames`."""
    joint, length = scene.joints[index], scene.sections[index - 1].length
    assert joint.C and joint.D and joint.E and joint.lL and joint.lR
    hinge = (length + joint.D[0], joint.D[1])
    start, end = frames[index - 1].point(hinge), frames[index].point(joint.E)
    apex = _apex(start, end, joint.lL, joint.lR, joint.side == "right")
    half_left, half_right = (joint.lL / 2, 0.0), (joint.lR / 2, 0.0)
    left = Link(joint.mL or 0.0, joint.lL, _between(start, apex), half_left, (-joint.lL / 2, 0.0))
    right = Link(joint.mR or 0.0, joint.lR, _between(apex, end), (-joint.lR / 2, 0.0), half_right)
    bears_right = joint.kind == "B3"
    along, aside = joint.R or (joint.lL, 0.0)  # B1 has no R; its rod pin is the apex
    rod_pin = (along - (half_right if bears_right else half_left)[0], aside)
    return SixBar(left, right, bears_right, rod_pin, (length + joint.C[0], joint.C[1]), hinge, joint.E)


def _between(start: Array, end: Array) -> Frame:
    middle = (start + end) / 2
    return Frame(float(middle[0]), float(middle[1]), math.atan2(end[1] - start[1], end[0] - start[0]))


def _apex(start: Array, end: Array, from_start: float, from_end: float, is_right: bool) -> Array:
    """Return the third corner of a triangle with these sides, left or right of start->end (law of cosines)."""
    base = end - start
    span = float(np.hypot(*base))
    opening = math.acos((span**2 + from_start**2 - from_end**2) / (2 * span * from_start))
    heading = math.atan2(base[1], base[0]) + (-opening if is_right else opening)
    return start + from_start * np.array([math.cos(heading), math.sin(heading)])
