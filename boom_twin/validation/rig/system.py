"""Build the Exudyn system: nodes, rigid frames, markers, pins, weights, where every part lies, and its mass."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...scene.kinematics import joint_angles_of_strokes
from ...scene.schema import Cylinder, Point, Scene
from ...types import Array
from . import items


@dataclass(frozen=True, slots=True)
class Lump:
    """Rigid mass (kg) with centre (m) and inertia about that centre (kg m^2)."""

    mass: float
    com: Point
    inertia: float


@dataclass(frozen=True, slots=True)
class Gathered:
    """Merged mass (kg) with centre from, and inertia about, the REFERENCE POINT (m, kg m^2)."""

    mass: float
    com: Point
    inertia: float


@dataclass(slots=True)
class Lumps:
    """Lumps of neighbours on one body: `inertia` resists acceleration, `weight` has weight."""

    inertia: list[Lump] = field(default_factory=list)
    weight: list[Lump] = field(default_factory=list)

    def both(self, lump: Lump) -> None:
        self.inertia.append(lump)
        self.weight.append(lump)


@dataclass(frozen=True, slots=True)
class LumpedMasses:
    """Lumps that replace cylinders and links without a body of their own."""

    sections: list[dict[float, Lumps]]  # lumps of every section by the pin's x (m), in the section's axes
    links: list[Lumps]  # lumps on the bearing link of every joint, in its axes

    @classmethod
    def none(cls, count: int) -> LumpedMasses:
        return cls([{} for _ in range(count)], [Lumps() for _ in range(count)])

    def on_section(self, index: int, x: float) -> Lumps:
        """Return the lumps that section `index` (0-based) bears at `x` (m)."""
        return self.sections[index].setdefault(x, Lumps())


def gather(lumps: list[Lump], reference_x: float) -> Gathered:
    """Return all lumps as one rigid mass about the point (`reference_x`, 0) of the section's axes."""
    mass = sum(lump.mass for lump in lumps)
    if mass == 0.0:
        return Gathered(0.0, (0.0, 0.0), sum(lump.inertia for lump in lumps))
    x = sum(lump.mass * (lump.com[0] - reference_x) for lump in lumps) / mass
    y = sum(lump.mass * lump.com[1] for lump in lumps) / mass
    inertia = sum(lump.inertia + lump.mass * ((lump.com[0] - reference_x) ** 2 + lump.com[1] ** 2) for lump in lumps)
    return Gathered(mass, (x, y), inertia)


def uniform_rod(start: float, end: float, per_length: float, rotary: float = 0.0) -> Lump:
    """Return a uniform rod on the section's axis: kg/m, and rotary inertia per length (kg m)."""
    length = end - start
    mass = per_length * length
    return Lump(mass, ((start + end) / 2, 0.0), mass * length**2 / 12 + rotary * length)


@dataclass(frozen=True, slots=True)
class Station:
    """A rigid frame of a section: its place x on the section (m), its node, its body, the node's reference angle."""

    x: float
    node: int
    body: int
    angle: float


@dataclass(frozen=True, slots=True)
class Base:
    """A body, the place of its origin (m), and the node of an elastic base; None for a rigid one, which is the ground."""

    body: int
    origin: Point
    node: int | None


@dataclass(slots=True)
class BuiltSection:
    """Stations of one section from root to head; a rigid section has one, at its pivot."""

    beam: Point | None
    stations: list[Station]
    beams: list[tuple[float, float, int]] = field(default_factory=list)
    """Start and end (m) of every beam element, and its object."""

    @property
    def root(self) -> Station:
        return self.stations[0]

    @property
    def head(self) -> Station:
        """Return the rigid frame of the next pivot; of a rigid section, its only one."""
        return self.stations[-1]

    def at(self, x: float) -> Station:
        """Return the rigid frame that carries a point at `x` (m)."""
        if self.beam is None or x <= self.beam[0]:
            return self.root
        if x >= self.beam[1]:
            return self.head
        return min(self.stations, key=lambda station: abs(station.x - x))


@dataclass(frozen=True, slots=True)
class Site:
    """Place of sensors: section, 0-based, and the distance from its inboard pivot, m."""

    section: int
    at: float


@dataclass(slots=True)
class Boom:
    """An assembled system of Exudyn and the numbers by which its parts are found."""

    scene: Scene
    container: Any
    system: Any
    gravity: list[float]
    base: Base  # carrier of the pivot and of cylinder 1
    nodally_exact: bool  # a straight, lightly bent beam is exact at its nodes however few they are
    shear_over_axial: float  # GA over EA
    elements: int  # finite elements per flexible section
    lumps: LumpedMasses | None  # masses of cylinders and two-force links, where these are no bodies
    sections: list[BuiltSection] = field(default_factory=list)
    drives: list[tuple[int, str]] = field(default_factory=list)  # connector of each cylinder, name of its length
    tip_load: int = -1  # the external force at the tip
    sites: tuple[Site, ...] = ()  # where sensors are; the beams there have nodes

    def marker(self, body: int, local: Point) -> int:
        """Add a marker on a rigid body, in the body's axes."""
        return int(self.system.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[*local, 0.0])))

    def point(self, station: Station, place: Point) -> int:
        """Add a marker on a section, in the section's axes."""
        return self.marker(station.body, (place[0] - station.x, place[1]))

    def on_base(self, place: Point) -> int:
        """Add a marker on the base, in the axes of the unloaded base."""
        return self.marker(self.base.body, (place[0] - self.base.origin[0], place[1] - self.base.origin[1]))

    def pin(self, one: int, other: int) -> None:
        self.system.AddObject(items.ObjectJointRevolute2D(markerNumbers=[one, other]))

    def node(self, place: Array, angle: float) -> int:
        return int(self.system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[*place, angle])))

    def rod(self, one: int, other: int, length: float) -> None:
        self.system.AddObject(items.ObjectConnectorDistance(markerNumbers=[one, other], distance=length))

    def body(self, node: int, mass: float, com: Point, inertia: float, weight: Gathered | None = None) -> int:
        """Add a rigid body on a node; inertia (kg m^2) about the NODE. Its mass weighs where it is, or as `weight` says."""
        body = int(
            self.system.AddObject(items.ObjectRigidBody2D(mass=mass, inertia=inertia, centerOfMass=[*com], nodeNumber=node))
        )
        if weight is not None:
            load = [weight.mass * part for part in self.gravity]
            self.system.AddLoad(items.LoadForceVector(markerNumber=self.marker(body, weight.com), loadVector=load))
        else:
            self.weigh(body)
        return body

    def push(self, load: Array) -> None:
        """Set the external force at the tip from now on, shape (2,), N, in the base's axes."""
        self.system.SetLoadParameter(self.tip_load, "loadVector", [*load, 0.0])

    def weigh(self, body: int) -> None:
        marker = self.system.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        self.system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=self.gravity))


@dataclass(frozen=True, slots=True)
class Frame:
    """Origin (m) and angle (rad) of a straight section in the base's axes."""

    x: float
    y: float
    angle: float

    def point(self, local: Point) -> Array:
        """Return the base coordinates (2,) of a point given in the section's axes."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        return np.array([self.x + c * local[0] - s * local[1], self.y + s * local[0] + c * local[1]])

    def local(self, place: Array) -> Array:
        """Return the coordinates (2,) in the section's axes of a point given in the base's."""
        c, s = math.cos(self.angle), math.sin(self.angle)
        x, y = place[0] - self.x, place[1] - self.y
        return np.array([c * x + s * y, c * y - s * x])


def section_frames(scene: Scene, strokes: Array) -> list[Frame]:
    """Return the frames of the straight sections on incompressible cylinders at absolute `strokes` (m)."""
    angles = np.cumsum(joint_angles_of_strokes(scene, strokes))
    frames, origin = [], np.array(scene.base.pivot)
    for section, angle in zip(scene.sections, angles, strict=True):
        frames.append(Frame(float(origin[0]), float(origin[1]), float(angle)))
        origin = frames[-1].point((section.length, 0.0))
    return frames


def oil_stiffness(cylinder: Cylinder, strokes: Array) -> Array:
    """Return the stiffness (N/m) of a compressible cylinder with its drive at `strokes` (m), shape as `strokes`."""
    if cylinder.oil is None:
        assert cylinder.k is not None
        return np.full(strokes.shape, cylinder.k)
    oil = cylinder.oil
    piston, ring = np.pi * (oil.bore / 2) ** 2, np.pi * ((oil.bore / 2) ** 2 - (oil.rod / 2) ** 2)
    inside = np.clip(strokes, 0.0, cylinder.max_stroke)
    per_metre = [piston / (oil.cap_line / piston + inside), ring / (oil.rod_line / ring + cylinder.max_stroke - inside)]
    return np.asarray(oil.bulk_modulus * sum(per_metre))
