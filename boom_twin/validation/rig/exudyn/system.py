"""The Exudyn system under construction: nodes, rigid frames, markers, pins and weights."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..records import Array
from ..scene.parts import Point, Scene
from .peer import items
from .play import Bush


@dataclass(frozen=True, slots=True)
class Station:
    """A rigid frame of a section: its place x on the section (m), its node, its body, the node's reference angle."""

    x: float
    node: int
    body: int
    angle: float


@dataclass(slots=True)
class BuiltSection:
    """Stations of one section from root to head; a rigid section has one, at its pivot."""

    beam: Point | None
    stations: list[Station]

    @property
    def root(self) -> Station:
        """The rigid frame of the pivot."""
        return self.stations[0]

    @property
    def head(self) -> Station:
        """The rigid frame of the next pivot; of a rigid section, its only one."""
        return self.stations[-1]

    def at(self, x: float) -> Station:
        """The rigid frame that carries a point at `x` (m)."""
        if self.beam is None or x <= self.beam[0]:
            return self.root
        if x >= self.beam[1]:
            return self.head
        return min(self.stations, key=lambda station: abs(station.x - x))


@dataclass(slots=True)
class Boom:
    """An assembled system and the numbers by which its parts are found.

    Attributes
    ----------
    container, system : object
        Exudyn's SystemContainer and MainSystem.
    sections : list of BuiltSection
    nodally_exact : bool
        Whether a straight, lightly bent beam is exact at its nodes however few they are.
    drives : list of (int, str)
        Connector of each cylinder, and the name of its length parameter.
    bushes : list of Bush
        Pins with play.
    """

    scene: Scene
    container: Any
    system: Any
    gravity: list[float]
    ground: int
    nodally_exact: bool
    sections: list[BuiltSection] = field(default_factory=list)
    drives: list[tuple[int, str]] = field(default_factory=list)
    bushes: list[Bush] = field(default_factory=list)

    def marker(self, body: int, local: Point) -> int:
        """A point of a rigid body, in the body's axes."""
        return int(self.system.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[*local, 0.0])))

    def point(self, station: Station, place: Point) -> int:
        """A point of a section, in the section's axes."""
        return self.marker(station.body, (place[0] - station.x, place[1]))

    def pin(self, one: int, other: int) -> None:
        """Two markers share their place."""
        self.system.AddObject(items.ObjectJointRevolute2D(markerNumbers=[one, other]))

    def loosen(self, bush: Bush) -> None:
        """Two markers touch as journal and bush."""
        self.system.AddObject(
            items.ObjectConnectorCartesianSpringDamper(markerNumbers=[*bush.sides], springForceUserFunction=bush.spring)
        )
        self.bushes.append(bush)

    def node(self, place: Array, angle: float) -> int:
        """A new node with three unknowns."""
        return int(self.system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[*place, angle])))

    def body(self, node: int, mass: float, com: Point, inertia: float) -> int:
        """A rigid body on a node; inertia (kg m^2) about the NODE."""
        body = int(
            self.system.AddObject(
                items.ObjectRigidBody2D(mass=mass, inertia=inertia, centerOfMass=[*com], nodeNumber=node)
            )
        )
        if mass > 0.0:
            self.weigh(body)
        return body

    def weigh(self, body: int) -> None:
        """Gravity on a body or beam."""
        marker = self.system.AddMarker(items.MarkerBodyMass(bodyNumber=body))
        self.system.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=self.gravity))
