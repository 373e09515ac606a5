"""Plausibility of rigid parts, links, barrels and rods: centre inside the part, inertia by its size, mass by its volume."""

from __future__ import annotations

import math

from ...config.yaml_text import Place
from ..schema import Cylinder, CylinderPart, Joint, RigidPart, Scene, Section, section_depth
from .cross_sections import density
from .draft import Draft, Findings

OVERHANG = 0.05  # of the section's length, that a rigid part may reach beyond the pivots
BESIDE = 2.0  # depths of the section, that a centre may lie beside its axis
LARGEST_GYRATION = 0.6  # of the size of a part
LEAST_SHARE, LONG_PART = 0.2, 0.03  # of the beam's mass per metre, in parts longer than a share of the section
ROD_BY_BEAM = (0.01, 10.0)  # mass per metre of barrels and rods against that of the section
LINK_BY_BEAM = (0.01, 1.5)  # likewise of links
CYLINDER_GYRATION = (0.05, 0.5)  # of the closed length; a uniform rod has 0.29
CYLINDER_CENTRE = 0.8  # of the closed length
LONGEST_STROKE = 0.95  # of the closed length
LONGEST_CYLINDER = 0.5  # of the section that it lies along: closed length
LINE = (1e-3, 2.0)  # oil between piston and valve, of what the chamber takes


def rigid_parts(draft: Draft, scene: Scene) -> Findings:
    """Check roots and heads."""
    for i, section in enumerate(scene.sections):
        ends = section.beam or (section.length, section.length)
        spans = {"root": (0.0, ends[0]), "head": (ends[1], section.length)}
        for key, span in spans.items():
            part = getattr(section, key)
            if part is not None and part.mass > 0.0:
                yield from _part(draft, scene, ("sections", i, key), part, span)


def _part(draft: Draft, scene: Scene, place: tuple[str, int, str], part: RigidPart, span: tuple[float, float]) -> Findings:
    section, depth = scene.sections[place[1]], section_depth(scene, place[1])
    more = OVERHANG * section.length
    low, high = span[0] - more, span[1] + more
    if not low <= part.com[0] <= high or abs(part.com[1]) > BESIDE * depth:
        bound = f"expected inside the {place[2]}: x from {low:.3g} to {high:.3g} m, y within {BESIDE * depth:.2g} m"
        remedy = "The centre of mass is measured from the INBOARD pivot, in the axes of the section."
        yield draft.warning((*place, "com"), part.com, bound, remedy)
        return
    size, radius = math.hypot(span[1] - span[0] + more, 2.0 * depth), math.sqrt(part.inertia / part.mass)
    if radius > LARGEST_GYRATION * size:
        bound = f"a radius of gyration of {radius:.3g} m; expected at most {LARGEST_GYRATION * size:.2g} m for its size"
        remedy = "Give kg m^2 about the part's OWN centre of mass: m (a^2 + b^2) / 12 of the block around it."
        yield draft.warning((*place, "inertia"), part.inertia, bound, remedy)
    yield from _part_mass(draft, scene, place, part.mass, (span[1] - span[0], depth))


def _part_mass(draft: Draft, scene: Scene, place: tuple[str, int, str], mass: float, size: tuple[float, float]) -> Findings:
    """Yield a warning if a part is lighter than a share of as much beam, or heavier than a solid block of its depth."""
    section, rho = scene.sections[place[1]], density(scene)
    (length, depth), lightest = size, 0.0
    if section.rho_A is not None and length > LONG_PART * section.length:
        lightest = LEAST_SHARE * section.rho_A * length
    heaviest = math.inf if rho is None else rho * depth**2 * (length + 2.0 * depth)
    if not lightest <= mass <= heaviest:
        bound = f"expected {lightest:.2g} to {heaviest:.3g} kg for a part {length:.2g} m long and {depth:.2g} m high"
        yield draft.warning((*place, "mass"), mass, bound, "Give kg: not grams, not tonnes; and check beam: [x0, x1].")


def moving_parts(draft: Draft, scene: Scene) -> Findings:
    """Check links and cylinders."""
    for i, (section, joint) in enumerate(zip(scene.sections, scene.joints, strict=True)):
        per_metre = _mass_per_metre(section)
        for key, length in (("mL", joint.lL), ("mR", joint.lR)):
            mass = getattr(joint, key)
            if mass and length:
                yield from _rod_mass(draft, ("joints", i, key), mass, length, per_metre, LINK_BY_BEAM)
        yield from _cylinder(draft, i, joint, per_metre)
        yield from _cylinder_size(draft, i, joint.cylinder, scene.sections[max(0, i - 1)].length)


def _mass_per_metre(section: Section) -> float:
    root = 0.0 if section.root is None else section.root.mass
    return section.rho_A if section.rho_A is not None else root / section.length


def _rod_mass(
    draft: Draft, place: Place, mass: float, length: float, per_metre: float, limits: tuple[float, float] = ROD_BY_BEAM
) -> Findings:
    low, high = (limit * per_metre * length for limit in limits)
    if per_metre > 0.0 and not low <= mass <= high:
        bound = f"expected {low:.2g} to {high:.2g} kg for {length:g} m beside a section of {per_metre:.3g} kg/m"
        yield draft.warning(place, mass, bound, "Give kg: not grams, not tonnes, not N.")


def _cylinder(draft: Draft, i: int, joint: Joint, per_metre: float) -> Findings:
    place, cylinder = ("joints", i, "cylinder"), joint.cylinder
    closed = cylinder.closed_length
    if cylinder.max_stroke > LONGEST_STROKE * closed:
        bound = f"expected at most {LONGEST_STROKE * closed:.3g} m: closed, the cylinder is {closed:g} m long"
        remedy = "Give the stroke, not the open length; closed_length is pin to pin with the rod all the way in."
        yield draft.warning((*place, "max_stroke"), cylinder.max_stroke, bound, remedy)
    for key in ("barrel", "rod"):
        part = getattr(cylinder, key)
        if part is not None and part.mass > 0.0:
            yield from _cylinder_part(draft, (*place, key), part, closed)
            yield from _rod_mass(draft, (*place, key, "mass"), part.mass, closed, per_metre)


def _cylinder_size(draft: Draft, i: int, cylinder: Cylinder, section: float) -> Findings:
    """Check closed length against the section beside it, oil in the lines against that in the chambers."""
    place, closed = ("joints", i, "cylinder"), cylinder.closed_length
    if closed > LONGEST_CYLINDER * section:
        bound = f"expected at most {LONGEST_CYLINDER * section:.3g} m beside a section of {section:g} m"
        remedy = "Check the pins at its ends: C from the outboard pivot, cylinder_pin from the same origin as pivot."
        yield draft.warning((*place, "closed_length"), closed, bound, remedy)
    if cylinder.oil is not None:
        for key, area in (("cap_line", cylinder.oil.cap_area), ("rod_line", cylinder.oil.rod_area)):
            volume, (least, most) = getattr(cylinder.oil, key), (share * area * cylinder.max_stroke for share in LINE)
            if 0.0 < volume < least or volume > most:
                words = f"at least {least:.2g} m^3, a thousandth of" if volume < least else f"at most {most:.2g} m^3, twice"
                bound = f"expected {words} what the chamber takes"
                yield draft.warning((*place, "oil", key), volume, bound, "Give m^3: half a litre is 5e-4.")


def _cylinder_part(draft: Draft, place: Place, part: CylinderPart, closed: float) -> Findings:
    if part.com > CYLINDER_CENTRE * closed:
        bound = f"expected at most {CYLINDER_CENTRE * closed:.3g} m: closed, the cylinder is {closed:g} m long"
        yield draft.warning((*place, "com"), part.com, bound, "Barrels count from the barrel pin, rods from the rod pin.")
    radius = math.sqrt(part.inertia / part.mass)
    low, high = (limit * closed for limit in CYLINDER_GYRATION)
    if part.inertia and not low <= radius <= high:
        bound = f"a radius of gyration of {radius:.3g} m; expected {low:.2g} to {high:.2g} m for a cylinder of {closed:g} m"
        yield draft.warning((*place, "inertia"), part.inertia, bound, "Give kg m^2 about the part's own centre of mass.")
