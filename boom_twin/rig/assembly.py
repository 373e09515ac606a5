"""Where every part of the undeformed boom lies when the drives have given lengths."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..records import Array
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.parts import Joint, Point, Scene


@dataclass(frozen=True, slots=True)
class Frame:
    """Origin (m) and angle (rad) of a straight section in the base's axes."""

    x: float
    y: float
    angle: float

    def point(self, local: Point) -> Array:
        """Base coordinates (2,) of a point given in the section's axes."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return np.array([self.x + c * local[0] - s * local[1], self.y + s * local[0] + c * local[1]])


def gravity_in_base(scene: Scene) -> Point:
    """Gravity (m/s^2) in the axes of the base, which its inclination turns anticlockwise."""
    c, s = math.cos(scene.base.inclination), math.sin(scene.base.inclination)
    gx, gy = scene.gravity
    return c * gx + s * gy, -s * gx + c * gy


def section_frames(scene: Scene, strokes: Array) -> list[Frame]:
    """Frames of the straight sections on incompressible cylinders at absolute `strokes` (m)."""
    angles = np.cumsum(joint_angles_of_strokes(scene, strokes))
    frames, origin = [], np.array(scene.base.pivot)
    for section, angle in zip(scene.sections, angles, strict=True):
        frames.append(Frame(float(origin[0]), float(origin[1]), float(angle)))
        origin = frames[-1].point((section.length, 0.0))
    return frames


def six_bar_points(scene: Scene, frames: list[Frame], index: int) -> dict[str, Array]:
    """Points C, D, E, Q (m, base axes) of the six-bar at joint `index` (0-based)."""
    joint: Joint = scene.joints[index]
    length = scene.sections[index - 1].length
    assert joint.C and joint.D and joint.E and joint.lL and joint.lR
    c = frames[index - 1].point((length + joint.C[0], joint.C[1]))
    d = frames[index - 1].point((length + joint.D[0], joint.D[1]))
    e = frames[index].point(joint.E)
    return {"C": c, "D": d, "E": e, "Q": _left_apex(d, e, joint.lL, joint.lR)}


def _left_apex(start: Array, end: Array, from_start: float, from_end: float) -> Array:
    """Third corner, left of start->end, of the triangle with these two sides (law of cosines)."""
    base = end - start
    span = float(np.hypot(*base))
    opening = math.acos((span**2 + from_start**2 - from_end**2) / (2 * span * from_start))
    heading = math.atan2(base[1], base[0]) + opening
    return start + from_start * np.array([math.cos(heading), math.sin(heading)])
