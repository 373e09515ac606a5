"""Joints of the Exudyn boom: pivots, links, and cylinders of barrel, rod and drive."""

from __future__ import annotations

import math

import numpy as np

from ..records import Array
from ..scene.parts import Cylinder, CylinderPart, Pin
from .assembly import Frame, six_bar_points
from .peer import items
from .play import Bush, contact_of, pin_with_play
from .system import Boom


def add_pivot(boom: Boom, index: int) -> None:
    """Pin section `index` (0-based) to the head before it, or to the base."""
    inboard = boom.point(boom.sections[index].root, (0.0, 0.0))
    if index == 0:
        carrier = boom.marker(boom.ground, boom.scene.base.pivot)
    else:
        carrier = boom.point(boom.sections[index - 1].head, (boom.scene.sections[index - 1].length, 0.0))
    boom.pin(carrier, inboard)


def add_joint(boom: Boom, frames: list[Frame], index: int, stroke: float) -> None:
    """Cylinder of joint `index` (0-based) with its drive at `stroke` (m), and the links that it works on."""
    cylinder = boom.scene.joints[index].cylinder
    if index == 0:
        place = boom.scene.sections[0].rod_pin
        assert place is not None
        barrel_pin = boom.marker(boom.ground, boom.scene.base.cylinder_pin)
        rod_pin = boom.point(boom.sections[0].at(place[0]), place)
        ends = np.array(boom.scene.base.cylinder_pin), frames[0].point(place)
    else:
        barrel_pin, rod_pin, ends = _six_bar(boom, frames, index)
    worn = pin_with_play(boom.scene, index)
    rod_end = _cylinder_part(boom, cylinder.rod, (rod_pin, barrel_pin), (ends[1], ends[0]), worn)
    _drive(boom, cylinder, (barrel_pin, rod_end), stroke)
    _cylinder_part(boom, cylinder.barrel, (barrel_pin, rod_end), ends)


def _six_bar(boom: Boom, frames: list[Frame], index: int) -> tuple[int, int, tuple[Array, Array]]:
    """Links of a B joint; gives the markers of barrel pin and rod pin with their places."""
    joint, carrier, turned = boom.scene.joints[index], boom.sections[index - 1], boom.sections[index]
    length, place = boom.scene.sections[index - 1].length, six_bar_points(boom.scene, frames, index)
    assert joint.C and joint.D and joint.E and joint.lL and joint.lR
    left, left_frame = _link(boom, joint.mL or 0.0, joint.lL, place["D"], place["Q"])
    right, right_frame = _link(boom, joint.mR or 0.0, joint.lR, place["Q"], place["E"])
    boom.pin(boom.point(carrier.head, (length + joint.D[0], joint.D[1])), boom.marker(left, (-joint.lL / 2, 0.0)))
    boom.pin(boom.marker(left, (joint.lL / 2, 0.0)), boom.marker(right, (-joint.lR / 2, 0.0)))
    boom.pin(boom.marker(right, (joint.lR / 2, 0.0)), boom.point(turned.root, joint.E))
    along, aside = joint.R or (joint.lL, 0.0)  # B1 has no R: its rod pin is Q
    link, frame, half = (right, right_frame, joint.lR / 2) if joint.kind == "B3" else (left, left_frame, joint.lL / 2)
    local = (along - half, aside)
    bracket = (length + joint.C[0], joint.C[1])
    barrel_pin = boom.point(carrier.at(bracket[0]), bracket)
    return barrel_pin, boom.marker(link, local), (place["C"], frame.point(local))


def _link(boom: Boom, mass: float, length: float, start: Array, end: Array) -> tuple[int, Frame]:
    """A uniform rod with its frame in its middle, x along it."""
    middle = (start + end) / 2
    frame = Frame(float(middle[0]), float(middle[1]), math.atan2(end[1] - start[1], end[0] - start[0]))
    return boom.body(boom.node(middle, frame.angle), mass, (0.0, 0.0), mass * length**2 / 12), frame


def _drive(boom: Boom, cylinder: Cylinder, pins: tuple[int, int], stroke: float) -> None:
    """Oil spring and damper between the pins, or the drive length itself where the scene names no oil spring."""
    length = cylinder.closed_length + stroke
    if cylinder.k is None:
        drive = boom.system.AddObject(items.ObjectConnectorDistance(markerNumbers=[*pins], distance=length))
        boom.drives.append((int(drive), "distance"))
        return
    drive = boom.system.AddObject(
        items.ObjectConnectorSpringDamper(
            markerNumbers=[*pins], referenceLength=length, stiffness=cylinder.k, damping=cylinder.d or 0.0
        )
    )
    boom.drives.append((int(drive), "referenceLength"))


def _cylinder_part(
    boom: Boom, part: CylinderPart | None, pins: tuple[int, int], ends: tuple[Array, Array], worn: Pin | None = None
) -> int:
    """Barrel or rod: pinned at its own end, its axis through the other end (so the two parts slide on each other).

    Gives the marker of its own end, which is off the pin's where the pin is `worn`.
    """
    if part is None or part.mass == part.inertia == 0.0:
        return pins[0]
    axis = ends[1] - ends[0]
    angle = math.atan2(axis[1], axis[0])
    node = boom.node(ends[0] + part.com * axis / np.hypot(*axis), angle)
    body = boom.body(node, part.mass, (0.0, 0.0), part.inertia)
    own = boom.marker(body, (-part.com, 0.0))
    if worn is None:
        boom.pin(pins[0], own)
    else:
        boom.loosen(Bush(contact_of(boom.scene, worn), (pins[0], own), node))
    boom.system.AddObject(
        items.ObjectJointPrismatic2D(
            markerNumbers=[pins[1], own],
            axisMarker0=[1.0, 0.0, 0.0],
            normalMarker1=[0.0, 1.0, 0.0],
            constrainRotation=False,
        )
    )
    return own if worn else pins[0]
