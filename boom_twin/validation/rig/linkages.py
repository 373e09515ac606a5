"""Six-bar linkages of B joints, and masses of cylinders and two-force links lumped on the bodies that they are pinned to.

A boom without bodies for cylinders and two-force links is held by 10 pins and rods instead of 29 pins and guides, which most
of a step's time goes into. Weights act at the pins by the law of the lever. Of what resists acceleration, a barrel turns with
the section that carries it (the first one's about its pin on the base), a rod is two masses at the cylinder's pins, a two-force
link is half its mass at either end. Everything is placed for the strokes at which the boom is built.

Of the default boom in the motion of the error study, all this is 0.08 mm of the tip and 0.4 % of its acceleration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...scene.schema import CylinderPart, Point, Scene
from ...types import Array
from .system import Frame, Lump, LumpedMasses


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
        return self.right if self.bears_right else self.left

    @property
    def two_force(self) -> Link:
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


NO_PART = CylinderPart(mass=0.0, inertia=0.0, com=0.0)


def lump_masses(scene: Scene, frames: list[Frame], strokes: Array) -> LumpedMasses:
    """Return the lumps of cylinders and two-force links, for straight sections at `frames` and `strokes` (m), shape (n,)."""
    found = LumpedMasses.none(len(frames))
    for index, joint in enumerate(scene.joints):
        length = joint.cylinder.closed_length + float(strokes[index])
        if index == 0:
            _first_cylinder(found, scene, length)
        else:
            linkage = six_bar(scene, frames, index)
            _two_force_link(found, linkage, index)
            _cylinder(found, scene, frames, linkage, index, length)
    return found


def _first_cylinder(found: LumpedMasses, scene: Scene, length: float) -> None:
    """Add the cylinder on the base: seen from its rod pin, masses at their distances from the barrel pin."""
    cylinder, place = scene.joints[0].cylinder, scene.sections[0].rod_pin
    assert place is not None
    barrel, rod = cylinder.barrel or NO_PART, cylinder.rod or NO_PART
    inertia = weight = 0.0
    for part, distance in ((barrel, barrel.com), (rod, length - rod.com)):
        inertia += (part.inertia + part.mass * distance**2) / length**2
        weight += part.mass * distance / length
    at = found.on_section(0, place[0])
    at.inertia.append(Lump(inertia, place, 0.0))
    at.weight.append(Lump(weight, place, 0.0))


def _two_force_link(found: LumpedMasses, linkage: SixBar, index: int) -> None:
    link = linkage.two_force
    place = linkage.hinge if linkage.bears_right else linkage.turned_hinge
    found.on_section(index - 1 if linkage.bears_right else index, place[0]).both(Lump(link.mass / 2, place, 0.0))
    found.links[index].both(Lump(link.mass / 2, linkage.bearing.apex, 0.0))


def _cylinder(found: LumpedMasses, scene: Scene, frames: list[Frame], linkage: SixBar, index: int, length: float) -> None:
    """Add the cylinder of a six-bar, between a bracket of the section before the joint and the bearing link."""
    cylinder = scene.joints[index].cylinder
    barrel, rod = cylinder.barrel or NO_PART, cylinder.rod or NO_PART
    bracket, link = found.on_section(index - 1, linkage.bracket[0]), found.links[index]
    bracket.inertia.append(Lump(barrel.mass, _barrel_centre(frames[index - 1], linkage, barrel.com), barrel.inertia))
    far = barrel.mass * barrel.com / length
    bracket.weight.append(Lump(barrel.mass - far, linkage.bracket, 0.0))
    link.weight.append(Lump(far, linkage.rod_pin, 0.0))
    far = rod.mass * rod.com / length
    bracket.both(Lump(far, linkage.bracket, 0.0))
    link.both(Lump(rod.mass - far, linkage.rod_pin, 0.0))


def _barrel_centre(carrier: Frame, linkage: SixBar, distance: float) -> Point:
    """Return the centre of a barrel, `distance` (m) from its pin towards the rod pin, in its section's axes."""
    pin = carrier.point(linkage.bracket)
    axis = linkage.bearing.frame.point(linkage.rod_pin) - pin
    x, y = carrier.local(pin + distance * axis / float(np.hypot(*axis)))
    return float(x), float(y)
