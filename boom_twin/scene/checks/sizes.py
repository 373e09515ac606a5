"""Plausibility of parts by each other.

Beams: box and mass per metre, by the length and by the section before. Rigid parts, links, barrels and rods: centre inside the
part, inertia by its size, mass by its volume.
"""

from __future__ import annotations

import math

from ...config.yaml_text import Place
from ..schema import Cylinder, CylinderPart, Joint, Point, RigidPart, Scene, Section, section_depth
from .draft import Draft, Findings

GYRATION_BY_HEIGHT = (0.28, 0.5)  # a solid block has 0.289, two thin flanges 0.5
GYRATION_BY_LENGTH = (0.004, 0.05)
COMPACTNESS = (0.12, 2.0)  # A^2 / I: a box with walls of about 1/170 and of a tenth of its height
MASS_BY_STEEL, SLACK = (1.0, 4.0), 1e-3  # of a value that was rounded
ROTARY_BY_STEEL = (0.3, 30.0)
TAPER = (1 / 40, 1.5)  # of EI against the section before
LEAST_BEAM = 0.6  # of the length
LONGEST_HEAD = 0.125  # of the length
DEEP, WALL = 2.4, 20.7  # a thin box is DEEP radii of gyration high, and its wall is A^2/(I WALL) of that
STEEL, STEEL_E = 7850.0, (1.9e11, 2.2e11)
STEEL_RHO, OF_STEEL = (7700.0, 8000.0), (1.7e11, 2.3e11)  # densities that only steel has, and its E with a wide margin
SPECIFIC_STIFFNESS = (8e6, 1.2e8)  # E / rho, m^2/s^2: glass fibre 1e7, metals 2.6e7, carbon fibre 9e7

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


def density(scene: Scene) -> float | None:
    """Return the density of the material, kg/m^3; None if it does not fit E.

    A density that is not given is that of steel if E is that of steel, else None.
    """
    known, stiffness = scene.material.rho, scene.material.E
    if known is None:
        return STEEL if _between(stiffness, STEEL_E, 1.0) else None
    return known if _between(stiffness, SPECIFIC_STIFFNESS, known) else None


def material(draft: Draft, scene: Scene) -> Findings:
    """Check Young's modulus against the density."""
    rho = scene.material.rho
    if rho is not None and not _between(scene.material.E, SPECIFIC_STIFFNESS, rho):
        low, high = (limit * rho for limit in SPECIFIC_STIFFNESS)
        bound = f"expected from {low:.2g} to {high:.2g} Pa with a density of {rho:g} kg/m^3"
        yield draft.warning(("material", "E"), scene.material.E, bound, "Steel has 2.06e11 Pa and 7850 kg/m^3.")
    elif rho is not None and _between(rho, STEEL_RHO, 1.0) and not _between(scene.material.E, OF_STEEL, 1.0):
        bound = f"expected from {OF_STEEL[0]:.2g} to {OF_STEEL[1]:.2g} Pa with the density of steel, {rho:g} kg/m^3"
        yield draft.warning(("material", "E"), scene.material.E, bound, "Check E, or give the density of this material.")


def beams(draft: Draft, scene: Scene) -> Findings:
    """Check all sections that have a beam."""
    for i, section in enumerate(scene.sections):
        if section.beam is not None and section.A is not None and section.I is not None:
            yield from _box(draft, i, section, section.A, section.I)
            yield from _per_metre(draft, i, section, density(scene))
            yield from _ends(draft, i, section, section.beam)
            yield from _taper(draft, scene, i, section.I)


def _box(draft: Draft, i: int, section: Section, area: float, inertia: float) -> Findings:
    place, radius = ("sections", i), math.sqrt(inertia / area)
    says = f"its radius of gyration, sqrt(I/A), is {radius:.3g} m"
    if section.height is not None and not _between(radius, GYRATION_BY_HEIGHT, section.height):
        bound = f"{says}; expected {_range(GYRATION_BY_HEIGHT, section.height)} for a box {section.height:g} m high"
        yield draft.warning((*place, "I"), inertia, bound, "Check I (m^4), A (m^2) and height (m).")
    elif not _between(radius, GYRATION_BY_LENGTH, section.length):
        bound = f"{says}; expected {_range(GYRATION_BY_LENGTH, section.length)} for a section of {section.length:g} m"
        yield draft.warning((*place, "I"), inertia, bound, "Check I (m^4), A (m^2) and length (m), decimals and units.")
    elif not _between(area**2, COMPACTNESS, inertia):
        depth = DEEP * radius
        walls = [f"{1e3 * depth * share / WALL:.2g}" for share in (area**2 / inertia, *COMPACTNESS)]
        bound = (
            f"with A = {area:g} m^2 this is a box about {depth:.2g} m high with walls of {walls[0]} mm; "
            f"expected {walls[1]} to {walls[2]} mm"
        )
        yield draft.warning((*place, "I"), inertia, bound, "Check the decimals of I (m^4) and A (m^2).")


def _per_metre(draft: Draft, i: int, section: Section, rho: float | None) -> Findings:
    assert section.A is not None and section.I is not None and section.rho_A is not None
    if rho is None:
        return
    place, steel = ("sections", i), rho * section.A
    if not _between(section.rho_A * (1.0 + SLACK), MASS_BY_STEEL, steel):
        bound = f"expected {_range(MASS_BY_STEEL, steel)} kg/m: the box alone, rho A, has {steel:.3g}"
        remedy = "Give the mass of one metre of beam: box, pipe line, hoses, without concrete (line_fill)."
        yield draft.warning((*place, "rho_A"), section.rho_A, bound, remedy)
    rotary = rho * section.I
    if section.rho_I and not _between(section.rho_I, ROTARY_BY_STEEL, rotary):
        bound = f"expected {_range(ROTARY_BY_STEEL, rotary)} kg m: the box alone, rho I, has {rotary:.3g}"
        yield draft.warning((*place, "rho_I"), section.rho_I, bound, "Give rho I, or leave it out.")


def _ends(draft: Draft, i: int, section: Section, beam: Point) -> Findings:
    place: Place = ("sections", i, "beam")
    (x0, x1), length = beam, section.length
    head = length - x1
    if x0 > 0.0 and x0 + x1 <= length * (1.0 + 1e-6) and head > LONGEST_HEAD * length:
        bound = f"[x0, x1] leave a rigid head of {head:.3g} m; expected at most {LONGEST_HEAD * length:.3g} m"
        remedy = f"x1 is measured from the inboard pivot; if {x1:g} m is the length of the beam, then x1 = {x0 + x1:g}."
        yield draft.warning(place, beam, bound, remedy)
    elif x1 - x0 < LEAST_BEAM * length:
        bound = f"{x1 - x0:.3g} m bend of {length:g} m; expected at least {LEAST_BEAM * length:.3g} m"
        yield draft.warning(place, beam, bound, "Give [x0, x1] from the inboard pivot: where the box begins and ends.")


def _taper(draft: Draft, scene: Scene, i: int, inertia: float) -> Findings:
    before = scene.sections[i - 1].I if i > 0 else None
    if before is not None and not _between(inertia, TAPER, before):
        bound = f"expected {_range(TAPER, before)} m^4 after sections[{i - 1}] with I = {before:g}"
        yield draft.warning(("sections", i, "I"), inertia, bound, "Booms taper outwards: check the decimals of both.")


def _between(value: float, limits: tuple[float, float], unit: float) -> bool:
    return limits[0] * unit <= value <= limits[1] * unit


def _range(limits: tuple[float, float], unit: float) -> str:
    return f"{limits[0] * unit:.3g} to {limits[1] * unit:.3g}"


# -- rigid parts, links and cylinders ------------------------------------------------------------------------------------


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
        root = 0.0 if section.root is None else section.root.mass
        per_metre = section.rho_A if section.rho_A is not None else root / section.length
        for key, length in (("mL", joint.lL), ("mR", joint.lR)):
            mass = getattr(joint, key)
            if mass and length:
                yield from _rod_mass(draft, ("joints", i, key), mass, length, per_metre, LINK_BY_BEAM)
        yield from _cylinder(draft, i, joint, per_metre)
        yield from _cylinder_size(draft, i, joint.cylinder, scene.sections[max(0, i - 1)].length)


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
