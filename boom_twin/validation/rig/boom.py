"""Build the boom in Exudyn: geometrically exact beams, rigid parts, pivots, links and cylinders.

The model shares no equation with the twin. Every node holds absolute x, y and rotation in the base's axes; the rigid
root and head of a section sit on the end nodes of its beam, so they add no unknowns. A part that the scene does not
name has no mass here; massless links stay as bodies, held by as many constraints as they have unknowns. A lumped boom
has no bodies for cylinders and two-force links; see `linkages`.

Sources: J. Simo and L. Vu-Quoc, "On the dynamics of flexible beams under large overall motions - the plane case",
J. Appl. Mech. 53 (1986), for the beam; Exudyn (J. Gerstmayr) for everything that is solved.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from ...errors import UsageError
from ...scene.kinematics import gravity_in_base
from ...scene.schema import Cylinder, CylinderPart, RigidPart, Scene
from ...types import Array
from . import exudyn, items
from .linkages import Link, lump_masses, six_bar
from .system import (
    Base,
    Boom,
    BuiltSection,
    Frame,
    Lump,
    Lumps,
    Site,
    Station,
    gather,
    oil_stiffness,
    section_frames,
    uniform_rod,
)

SAME_PLACE = 1e-9  # m
SHEAR_OVER_AXIAL = 10.0  # GA = 10 EA: Euler-Bernoulli in effect; of the default boom's tip, shear is then 0.02 mm


def _part(part: RigidPart | None) -> list[Lump]:
    return [] if part is None else [Lump(part.mass, part.com, part.inertia)]


def _tip(scene: Scene, index: int) -> list[Lump]:
    if scene.tip is None or not scene.tip.payload or index != len(scene.sections) - 1:
        return []
    return [Lump(scene.tip.payload, (scene.sections[index].length, 0.0), 0.0)]


def add_section(boom: Boom, frame: Frame, index: int, elements: int) -> BuiltSection:
    """Add section `index` (0-based) of about `elements` finite elements. A rigid frame carries every cylinder pin."""
    borne = boom.lumps.sections[index] if boom.lumps else {}
    section, concrete = boom.scene.sections[index], boom.scene.line_fill or 0.0
    root, head, tip = _part(section.root), _part(section.head), _tip(boom.scene, index)
    if not boom.scene.is_flexible(index):
        beam = [] if section.beam is None else [uniform_rod(*section.beam, section.rho_A or 0.0, section.rho_I or 0.0)]
        whole = [*root, *head, *beam, uniform_rod(0.0, section.length, concrete), *tip]
        return BuiltSection(None, [_station(boom, frame, 0.0, whole, [*borne.values()])])
    assert section.beam is not None
    inside, (low, high) = _places_on_beam(boom, index), section.beam
    places = [low, *inside, high]
    inboard, outboard = uniform_rod(0.0, low, concrete), uniform_rod(high, section.length, concrete)
    own = [[*root, inboard], *([] for _ in inside), [*head, outboard, *tip]]
    near = {x: int(np.argmin([abs(x - place) for place in places])) for x in borne}
    stations = [
        _station(boom, frame, x, lumps, [borne[pin] for pin in borne if near[pin] == number])
        for number, (x, lumps) in enumerate(zip(places, own, strict=True))
    ]
    beams: list[tuple[float, float, int]] = []
    for start, end in pairwise(stations):
        share = (end.x - start.x) / (section.beam[1] - section.beam[0])
        beams += _beam_part(boom, frame, index, (start, end), max(1, round(elements * share)))
    return BuiltSection(section.beam, stations, beams)


def _station(boom: Boom, frame: Frame, x: float, own: list[Lump], borne: list[Lumps]) -> Station:
    mass = gather([*own, *(lump for lumps in borne for lump in lumps.inertia)], x)
    weight = gather([*own, *(lump for lumps in borne for lump in lumps.weight)], x) if borne else None
    node = boom.node(frame.point((x, 0.0)), frame.angle)
    return Station(x, node, boom.body(node, mass.mass, mass.com, mass.inertia, weight), frame.angle)


def _places_on_beam(boom: Boom, index: int) -> list[float]:
    """Return the places (m) on the flexible part of a section where a cylinder is pinned to it, or a sensor sits."""
    scene, section = boom.scene, boom.scene.sections[index]
    assert section.beam is not None
    places = [site.at for site in boom.sites if site.section == index]
    if index == 0 and section.rod_pin is not None:
        places.append(section.rod_pin[0])
    if index + 1 < len(scene.joints):
        bracket = scene.joints[index + 1].C
        assert bracket is not None
        places.append(section.length + bracket[0])
    low, high = section.beam[0] + SAME_PLACE, section.beam[1] - SAME_PLACE
    return sorted({round(x, 9) for x in places if low < x < high})


def _beam_part(
    boom: Boom, frame: Frame, index: int, ends: tuple[Station, Station], elements: int
) -> list[tuple[float, float, int]]:
    """Add the elements between two stations; return start and end of each, and its object."""
    section, scene = boom.scene.sections[index], boom.scene
    assert section.A is not None and section.I is not None
    axial, bending, beta = scene.material.E * section.A, scene.material.E * section.I, section.beta or 0.0
    places = np.linspace(ends[0].x, ends[1].x, elements + 1)
    inner = [boom.node(frame.point((float(x), 0.0)), frame.angle) for x in places[1:-1]]
    nodes = [ends[0].node, *inner, ends[1].node]
    length = float(places[1] - places[0])
    shear = shear_stiffness(boom.shear_over_axial * axial, bending, length if boom.nodally_exact else 0.0)
    found = []
    for pair, (start, end) in zip(pairwise(nodes), pairwise(places.tolist()), strict=True):
        beam = boom.system.AddObject(
            items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=[*pair],
                length=length,
                massPerLength=(section.rho_A or 0.0) + (scene.line_fill or 0.0),
                crossSectionInertia=section.rho_I or 0.0,
                bendingStiffness=bending,
                axialStiffness=axial,
                shearStiffness=shear,
                bendingDamping=beta * bending,
                axialDamping=beta * axial,
                shearDamping=beta * shear,
            )
        )
        boom.weigh(int(beam))
        found.append((start, end, int(beam)))
    return found


def shear_stiffness(shear: float, bending: float, length: float) -> float:
    """Return the shear stiffness (N) of an element: the beam's, `shear`, in series with 12 EI / `length`^2.

    An element of constant curvature lacks the bending of a constant shear force, whose flexibility is length^2 / 12 EI. Given
    back as shear, it makes nodes of a straight beam exact under loads at nodes; a `length` of 0 leaves it out.

    Source: R. MacNeal, "A simple quadrilateral shell element", Computers & Structures 8 (1978), residual bending flexibility.
    """
    return 1.0 / (1.0 / shear + length**2 / (12.0 * bending))


def add_base(system: Any, ground: int, scene: Scene) -> Base:
    """Return the ground, or add an elastic base: a body without mass on a pin and a torsional spring at the pivot."""
    base = scene.base
    if base.stiffness is None:
        return Base(ground, (0.0, 0.0), None)
    node = int(system.AddNode(items.NodeRigidBody2D(referenceCoordinates=[*base.pivot, 0.0])))
    body = int(system.AddObject(items.ObjectRigidBody2D(mass=0.0, inertia=0.0, nodeNumber=node)))
    sides = [
        int(system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=[*base.pivot, 0.0]))),
        int(system.AddMarker(items.MarkerBodyRigid(bodyNumber=body, localPosition=[0.0, 0.0, 0.0]))),
    ]
    system.AddObject(items.ObjectJointRevolute2D(markerNumbers=sides))
    system.AddObject(
        items.ObjectConnectorTorsionalSpringDamper(markerNumbers=sides, stiffness=base.stiffness, damping=base.damping or 0.0)
    )
    return Base(body, base.pivot, node)


def add_pivot(boom: Boom, index: int) -> None:
    """Pin section `index` (0-based) to the head before it, or to the base."""
    inboard = boom.point(boom.sections[index].root, (0.0, 0.0))
    if index == 0:
        carrier = boom.on_base(boom.scene.base.pivot)
    else:
        carrier = boom.point(boom.sections[index - 1].head, (boom.scene.sections[index - 1].length, 0.0))
    boom.pin(carrier, inboard)


def add_joint(boom: Boom, frames: list[Frame], index: int, stroke: float) -> None:
    """Add the cylinder of joint `index` (0-based) with its drive at `stroke` (m), and the links that it works on."""
    cylinder = boom.scene.joints[index].cylinder
    if index == 0:
        place = boom.scene.sections[0].rod_pin
        assert place is not None
        barrel_pin = boom.on_base(boom.scene.base.cylinder_pin)
        rod_pin = boom.point(boom.sections[0].at(place[0]), place)
        ends = np.array(boom.scene.base.cylinder_pin), frames[0].point(place)
    else:
        barrel_pin, rod_pin, ends = _six_bar(boom, frames, index)
    if boom.lumps:
        _drive(boom, cylinder, (barrel_pin, rod_pin), stroke)
        return
    _cylinder_part(boom, cylinder.rod, (rod_pin, barrel_pin), (ends[1], ends[0]))
    _drive(boom, cylinder, (barrel_pin, rod_pin), stroke)
    _cylinder_part(boom, cylinder.barrel, (barrel_pin, rod_pin), ends)


def _six_bar(boom: Boom, frames: list[Frame], index: int) -> tuple[int, int, tuple[Array, Array]]:
    """Add the links of a B joint; return the markers of barrel pin and rod pin with their places."""
    linkage, carrier, turned = six_bar(boom.scene, frames, index), boom.sections[index - 1], boom.sections[index]
    if boom.lumps:
        bearing = _link(boom, linkage.bearing, boom.lumps.links[index])
    else:
        left, right = _link(boom, linkage.left), _link(boom, linkage.right)
        bearing = right if linkage.bears_right else left
    hinge, turned_hinge = boom.point(carrier.head, linkage.hinge), boom.point(turned.root, linkage.turned_hinge)
    if boom.lumps:
        near, far = (turned_hinge, hinge) if linkage.bears_right else (hinge, turned_hinge)
        boom.pin(near, boom.marker(bearing, linkage.bearing.outer))
        boom.rod(boom.marker(bearing, linkage.bearing.apex), far, linkage.two_force.length)
    else:
        boom.pin(hinge, boom.marker(left, linkage.left.outer))
        boom.pin(boom.marker(left, linkage.left.apex), boom.marker(right, linkage.right.apex))
        boom.pin(boom.marker(right, linkage.right.outer), turned_hinge)
    barrel_pin = boom.point(carrier.at(linkage.bracket[0]), linkage.bracket)
    ends = frames[index - 1].point(linkage.bracket), linkage.bearing.frame.point(linkage.rod_pin)
    return barrel_pin, boom.marker(bearing, linkage.rod_pin), ends


def _link(boom: Boom, link: Link, borne: Lumps | None = None) -> int:
    node = boom.node(np.array([link.frame.x, link.frame.y]), link.frame.angle)
    if borne is None:
        return boom.body(node, link.mass, link.lump.com, link.lump.inertia)
    mass, weight = (gather([link.lump, *lumps], 0.0) for lumps in (borne.inertia, borne.weight))
    return boom.body(node, mass.mass, mass.com, mass.inertia, weight)


def _drive(boom: Boom, cylinder: Cylinder, pins: tuple[int, int], stroke: float) -> None:
    """Add oil spring and damper between the pins, or the drive length itself where the scene names no oil spring."""
    length = cylinder.closed_length + stroke
    if not cylinder.is_compressible:
        drive = boom.system.AddObject(items.ObjectConnectorDistance(markerNumbers=[*pins], distance=length))
        boom.drives.append((int(drive), "distance"))
        return
    drive = boom.system.AddObject(
        items.ObjectConnectorSpringDamper(
            markerNumbers=[*pins],
            referenceLength=length,
            stiffness=float(oil_stiffness(cylinder, np.array(stroke))),
            damping=cylinder.d or 0.0,
        )
    )
    boom.drives.append((int(drive), "referenceLength"))


def _cylinder_part(boom: Boom, part: CylinderPart | None, pins: tuple[int, int], ends: tuple[Array, Array]) -> None:
    """Add barrel or rod, pinned at its own end; the two slide on each other."""
    if part is None or part.mass == part.inertia == 0.0:
        return
    axis = ends[1] - ends[0]
    angle = math.atan2(axis[1], axis[0])
    node = boom.node(ends[0] + part.com * axis / np.hypot(*axis), angle)
    body = boom.body(node, part.mass, (0.0, 0.0), part.inertia)
    own = boom.marker(body, (-part.com, 0.0))
    boom.pin(pins[0], own)
    boom.system.AddObject(
        items.ObjectJointPrismatic2D(
            markerNumbers=[pins[1], own],
            axisMarker0=[1.0, 0.0, 0.0],
            normalMarker1=[0.0, 1.0, 0.0],
            constrainRotation=False,
        )
    )


def build(
    scene: Scene,
    strokes: Array,
    elements: int = 16,
    nodally_exact: bool = False,
    lumped: bool = False,
    shear_over_axial: float = SHEAR_OVER_AXIAL,
    sites: tuple[Site, ...] = (),
) -> Boom:
    """Build the undeformed boom with its drives at absolute `strokes` (m), shape (n,). Sensors may still be added.

    A flexible section has `elements` finite elements, at least one per part between cylinder brackets. `nodally_exact`: few
    elements bend as many do, see `shear_stiffness`. `lumped`: see `linkages`; it needs a rigid base.
    Sensors are at `sites`. UsageError for worn pins, and for a lumped boom that cannot be.
    """
    if scene.clearance is not None and scene.clearance.pins:
        raise UsageError("clearance.pins: the virtual rig knows ideal pins only. Leave out the block clearance.")
    if lumped and scene.base.stiffness is not None:
        raise UsageError("base.stiffness: a boom of lumped masses needs a rigid base. Leave it out, or take lumped=False.")
    container = exudyn.SystemContainer()
    system = container.AddSystem()
    ground = int(system.AddObject(items.ObjectGround()))
    frames = section_frames(scene, strokes)
    lumps = lump_masses(scene, frames, strokes) if lumped else None
    gravity = [*gravity_in_base(scene).tolist(), 0.0]
    base = add_base(system, ground, scene)
    boom = Boom(scene, container, system, gravity, base, nodally_exact, shear_over_axial, elements, lumps, sites=sites)
    for index, frame in enumerate(frames):
        boom.sections.append(add_section(boom, frame, index, elements))
        add_pivot(boom, index)
        add_joint(boom, frames, index, float(strokes[index]))
    tip = boom.point(boom.sections[-1].head, (scene.sections[-1].length, 0.0))
    boom.tip_load = int(system.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=[0.0, 0.0, 0.0])))
    return boom
