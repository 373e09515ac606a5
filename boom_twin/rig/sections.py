"""Sections of the Exudyn boom: geometrically exact beams between rigid frames, or one rigid frame alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..scene.parts import Scene
from . import masses
from .assembly import Frame
from .peer import items
from .system import Boom, BuiltSection, Station

SAME_PLACE = 1e-9  # m
SHEAR_OVER_AXIAL = 10.0  # GA = 10 EA: Euler-Bernoulli in effect; of the default boom's tip, shear is then 0.02 mm


def add_section(boom: Boom, frame: Frame, index: int, elements: int) -> BuiltSection:
    """Section `index` (0-based) of about `elements` finite elements; a rigid frame carries every cylinder pin."""
    if not boom.scene.is_flexible(index):
        mass = masses.gather(masses.rigid_section(boom.scene, index), 0.0)
        return BuiltSection(None, [_station(boom, frame, 0.0, mass)])
    section = boom.scene.sections[index]
    assert section.beam is not None
    inside = _bracket_places(boom.scene, index)
    root = masses.gather(masses.flexible_root(boom.scene, section), section.beam[0])
    head = masses.gather(masses.flexible_head(boom.scene, index), section.beam[1])
    none = masses.gather([], 0.0)
    stations = [_station(boom, frame, section.beam[0], root)]
    stations += [_station(boom, frame, x, none) for x in inside]
    stations.append(_station(boom, frame, section.beam[1], head))
    for start, end in pairwise(stations):
        share = (end.x - start.x) / (section.beam[1] - section.beam[0])
        _beam_part(boom, frame, index, (start, end), max(1, round(elements * share)))
    return BuiltSection(section.beam, stations)


def _station(boom: Boom, frame: Frame, x: float, mass: masses.Gathered) -> Station:
    node = boom.node(frame.point((x, 0.0)), frame.angle)
    return Station(x, node, boom.body(node, mass.mass, mass.com, mass.inertia), frame.angle)


def _bracket_places(scene: Scene, index: int) -> list[float]:
    """Places (m) on the flexible part of a section where a cylinder is pinned to it."""
    section = scene.sections[index]
    assert section.beam is not None
    places = []
    if index == 0 and section.rod_pin is not None:
        places.append(section.rod_pin[0])
    if index + 1 < len(scene.joints):
        bracket = scene.joints[index + 1].C
        assert bracket is not None
        places.append(section.length + bracket[0])
    low, high = section.beam[0] + SAME_PLACE, section.beam[1] - SAME_PLACE
    return sorted({round(x, 9) for x in places if low < x < high})


def _beam_part(boom: Boom, frame: Frame, index: int, ends: tuple[Station, Station], elements: int) -> None:
    section, scene = boom.scene.sections[index], boom.scene
    assert section.A is not None and section.I is not None
    axial, bending, beta = scene.material.E * section.A, scene.material.E * section.I, section.beta or 0.0
    places = np.linspace(ends[0].x, ends[1].x, elements + 1)
    inner = [boom.node(frame.point((float(x), 0.0)), frame.angle) for x in places[1:-1]]
    nodes = [ends[0].node, *inner, ends[1].node]
    length = float(places[1] - places[0])
    shear = shear_stiffness(axial, bending, length if boom.nodally_exact else 0.0)
    for pair in pairwise(nodes):
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


def shear_stiffness(axial: float, bending: float, length: float) -> float:
    """Shear stiffness (N) of an element: the beam's, in series with 12 EI / `length`^2.

    An element of constant curvature lacks the bending of a constant shear force, whose flexibility is length^2 / 12 EI. Given
    back as shear, it makes nodes of a straight beam exact under loads at nodes; a `length` of 0 leaves it out.

    Source: R. MacNeal, "A simple quadrilateral shell element", Computers & Structures 8 (1978), residual bending flexibility.
    """
    return 1.0 / (1.0 / (SHEAR_OVER_AXIAL * axial) + length**2 / (12.0 * bending))
