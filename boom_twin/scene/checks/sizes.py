"""Plausible sizes: values that look like another unit, then parts against each other.

Beams: box and mass per metre, by the length. Rigid parts, links, barrels and rods: centre inside the
part, inertia by its size, mass by its volume. Of several findings at one key the first is told.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pydantic import BaseModel

from ...config.yaml_text import Place
from ..schema import DEPTH_BY_GYRATION, Cylinder, Point, RigidPart, Scene
from . import Draft, Findings

LENGTHS = ("length", "beam", "height", "rod_pin", "com", "pivot", "cylinder_pin", "C", "D", "E", "R", "lL", "lR",
           "closed_length", "max_stroke")  # fmt: skip
BULK = (4e8, 2.5e9)  # Pa; water has 2.2e9
TURNS = "the joint turns by"


class Suspect(NamedTuple):
    """Keys whose values look wrong below a least or above a greatest magnitude: what they look like, what to do.

    Remedies are formatted with the value (``{0:g}``) and `factor` times the value (``{1:g}``).
    """

    keys: tuple[str, ...]
    least: float
    most: float
    looks: str
    remedy: str
    factor: float = 1.0


_K = "expected from 1e6 to 1e9 N/m"
_OIL_HAS = "hydraulic oil has 1.4e9 to 1.7e9, with air in it less"
SUSPECTS = (
    Suspect(("Young's modulus",), 1e3, math.inf, "less than 1e6 Pa: GPa or MPa?", "Give Pa: {0:g} GPa are {1:g}.", 1e9),
    Suspect(("Young's modulus",), 1e6, math.inf, "less than 1e6 Pa: GPa or MPa?", "Give Pa: {0:g} MPa are {1:g}.", 1e6),
    Suspect(("rho",), 50.0, math.inf, "less than 50 kg/m^3: g/cm^3 or t/m^3?", "Give kg/m^3: {1:g}.", 1e3),
    Suspect(("k",), 1e3, math.inf, f"{_K}: kN/mm?", "Give N/m: {0:g} kN/mm are {1:g}.", 1e6),
    Suspect(("k",), 1e6, math.inf, f"{_K}: kN/m?", "Give N/m: {0:g} kN/m are {1:g}.", 1e3),
    Suspect(("k",), 0.0, 1e9, _K, "Check its unit, N/m, or the bore and the oil that it comes from."),
    Suspect(("bulk_modulus",), *BULK, f"expected from {BULK[0]:.2g} to {BULK[1]:.2g} Pa: {_OIL_HAS}",
            "Check its unit: 1.4 GPa are 14000 bar."),
    Suspect(("payload",), 1.0, math.inf, "less than 1 kg: tonnes?", "Give kg: {0:g} t are {1:g}.", 1e3),
    Suspect(("mass", "mL", "mR", "payload"), 0.0, 1e5, "more than 1e5 kg: grams?", "Give kg: {0:g} g are {1:g}.", 1e-3),
    Suspect(("A",), 0.0, 1.0, "more than 1 m^2: cm^2 or mm^2?", "Give the area in m^2: 49 cm^2 is 4.9e-3."),
    Suspect(("I",), 0.0, 0.1, "more than 0.1 m^4: cm^4 or mm^4?", "Give the second moment in m^4: 3600 cm^4 is 3.6e-5."),
    Suspect(("rho_A",), 0.0, 5e3, "more than 5000 kg/m: a density in kg/m^3?", "Give the mass of one metre of the section."),
    Suspect(("line_fill",), 0.0, 100.0, "more than 100 kg/m: the whole load in kg?", "Give the concrete in one metre of pipe."),
    Suspect(("inclination",), 0.0, 0.2, "more than 0.2 rad, which is 11.5 degrees: degrees?",
            "Give radians: 5 degrees are 0.0873."),
    Suspect(("stiffness",), 1e5, math.inf, "less than 1e5 N m/rad: kN m/rad?", "Give N m/rad: {0:g} kN m/rad are {1:g}.", 1e3),
    Suspect(("stiffness",), 0.0, 1e12, "more than 1e12 N m/rad, which is rigid", "Leave stiffness out for a rigid base."),
    Suspect(("closed_length", "max_stroke"), 0.0, 50.0, "more than 50 m: mm?", "Give lengths in m."),
    Suspect(("cap_line", "rod_line"), 0.0, 0.5, "more than 0.5 m^3: litres?", "Give m^3: 1 litre is 1e-3."),
)  # fmt: skip
"""Values that look like another unit; the first that applies to a key is reported."""


def suspects(draft: Draft) -> Findings:
    """Check the size of all values of all usable parts."""
    scene = draft.scene
    blocks: list[tuple[Place, Any]] = [((key,), getattr(scene, key)) for key in ("material", "base", "tip", "line_fill")]
    blocks += [(("sections", i), section) for i, section in enumerate(scene.sections)]
    blocks += [(("joints", i), joint) for i, joint in enumerate(scene.joints)]
    for place, block in blocks:
        if block is not None:
            yield from _block(draft, place, block)
    yield from _gravity(draft)
    for name, angles in scene.postures.items():
        if angles and max(map(abs, angles)) < 6.3 and any(angle != round(angle) for angle in angles):
            yield draft.warning(("postures", name), angles, "all within 6.3: radians?", "Give degrees to the horizontal.")


def _block(draft: Draft, place: Place, block: Any) -> Findings:
    if not isinstance(block, BaseModel):
        yield from _value(draft, place, block)
        return
    for key in type(block).model_fields:
        if (value := getattr(block, key)) is not None:
            yield from _block(draft, (*place, key), value)


def _value(draft: Draft, place: Place, value: Any) -> Findings:
    """Yield a warning of a value that looks like another unit. A zero is a value that is left out."""
    key, numbers = str(place[-1]), value if isinstance(value, tuple) else (value,)
    size = max((abs(item) for item in numbers if isinstance(item, int | float)), default=0.0)
    key = "Young's modulus" if place == ("material", "E") else key  # E is also a pin
    if key == "range_deg":
        yield from _narrow(draft, place, value)
    elif key in LENGTHS and size > 200:
        written = draft.document.written(place)
        told = f"written as `{written}`, which is more than 200 m" if isinstance(written, str) else "more than 200 m: mm?"
        yield draft.warning(place, value, told, "Give lengths in m, or with their unit: 8500 mm.")
    else:
        for suspect in SUSPECTS:
            if key in suspect.keys and size and not suspect.least <= size <= suspect.most:
                yield draft.warning(place, value, suspect.looks, suspect.remedy.format(value, suspect.factor * value))
                return


def _narrow(draft: Draft, place: Place, value: tuple[float, float]) -> Findings:
    narrow = 25.0  # deg; joints of booms turn by 60 and more
    if 0.0 < value[1] - value[0] < narrow:
        bound = f"{TURNS} {value[1] - value[0]:.3g} deg in all; expected at least {narrow:g} deg"
        yield draft.warning(place, value, bound, "Give the lowest and the highest joint angle in degrees; check the decimals.")


def _gravity(draft: Draft) -> Findings:
    near = 0.1  # m/s^2, difference to the earth's gravity
    gravity = draft.scene.gravity
    if math.dist(gravity, (0.0, -9.81)) > near:
        bound = f"expected [0.0, -9.81] within {near:g} m/s^2: the earth's gravity, along -y, which is down"
        yield draft.warning(("gravity",), gravity, bound, "Give [0.0, -9.81]; a slope is base.inclination, rad.")


# -- parts against each other -----------------------------------------------------------------------------------------

STEEL, STEEL_E = 7850.0, (1.9e11, 2.2e11)
SPECIFIC_STIFFNESS = (8e6, 1.2e8)  # E / rho, m^2/s^2: glass fibre 1e7, metals 2.6e7, carbon fibre 9e7


class Ratio(NamedTuple):
    """Value of a key over a measure, both of one part; texts are formatted with the part's quantities."""

    key: str
    limits: tuple[float, float]
    by: str  # quantity that the limits are multiples of; the value is not judged without it
    where: str
    remedy: str
    measured: str = ""  # quantity that is judged instead of the value
    says: str = ""


_RADIUS = "a radius of gyration of {radius:.3g} m; "
_BOX_RADIUS = "its radius of gyration, sqrt(I/A), is {radius:.3g} m; "
_BOX = "with A = {A:g} m^2 this is a box about {depth:.2g} m high with walls of {wall:.2g} mm; "
_CLOSED = " m: closed, the cylinder is {closed_length:g} m long"
_WEIGHS = " kg for {length:g} m beside a section of {per_metre:.3g} kg/m"
_PART = " kg for a part {length:.2g} m long and {depth:.2g} m high"
_KG = "Give kg: not grams, not tonnes, not N."
_PART_KG = "Give kg: not grams, not tonnes; and check beam: [x0, x1]."
_LINE, _LITRES = " m^3, a thousandth to twice what the chamber takes", "Give m^3: half a litre is 5e-4."

MATERIAL = (
    Ratio("E", SPECIFIC_STIFFNESS, "rho", " Pa with a density of {rho:g} kg/m^3", "Steel has 2.06e11 Pa and 7850 kg/m^3."),
    Ratio("E", (1.7e11, 2.3e11), "of_steel", " Pa with the density of steel, {rho:g} kg/m^3",
          "Check E, or give the density of this material."),
)  # fmt: skip
BEAM = (
    Ratio("I", (0.28, 0.5), "height", " for a box {height:g} m high", "Check I (m^4), A (m^2) and height (m).", "radius",
          _BOX_RADIUS),  # a solid block has 0.289, two thin flanges 0.5
    Ratio("I", (0.004, 0.05), "length", " for a section of {length:g} m",
          "Check I (m^4), A (m^2) and length (m), decimals and units.", "radius", _BOX_RADIUS),
    Ratio("I", (0.12, 2.0), "thin_wall", " mm", "Check the decimals of I (m^4) and A (m^2).", "wall", _BOX),
    Ratio("rho_A", (1.0, 4.0), "steel", " kg/m: the box alone, rho A, has {steel:.3g}",
          "Give the mass of one metre of beam: box, pipe line, hoses, without concrete (line_fill).", "slack"),
    Ratio("rho_I", (0.3, 30.0), "rotary", " kg m: the box alone, rho I, has {rotary:.3g}", "Give rho I, or leave it out."),
)  # fmt: skip
RIGID_PART = (
    Ratio("inertia", (0.0, 0.6), "size", " m for its size",
          "Give kg m^2 about the part's OWN centre of mass: m (a^2 + b^2) / 12 of the block around it.", "radius", _RADIUS),
    Ratio("mass", (1.0, math.inf), "lightest", _PART, _PART_KG),
    Ratio("mass", (0.0, 1.0), "heaviest", _PART, _PART_KG),
)  # fmt: skip
LINK = (Ratio("mass", (0.01, 1.5), "beside", _WEIGHS, _KG),)
CYLINDER_PART = (
    Ratio("com", (0.0, 0.8), "closed_length", _CLOSED, "Barrels count from the barrel pin, rods from the rod pin."),
    Ratio("inertia", (0.05, 0.5), "closed_length", " m for a cylinder of {closed_length:g} m",
          "Give kg m^2 about the part's own centre of mass.", "radius", _RADIUS),  # a uniform rod has 0.29
    Ratio("mass", (0.01, 10.0), "beside", _WEIGHS, _KG),
)  # fmt: skip
CYLINDER = (
    Ratio("max_stroke", (0.0, 0.95), "closed_length", _CLOSED,
          "Give the stroke, not the open length; closed_length is pin to pin with the rod all the way in."),
    Ratio("closed_length", (0.0, 0.5), "carrier", " m beside a section of {carrier:g} m",
          "Check the pins at its ends: C from the outboard pivot, cylinder_pin from the same origin as pivot."),
)  # fmt: skip
OIL = (
    Ratio("cap_line", (1e-3, 2.0), "cap_volume", _LINE, _LITRES),
    Ratio("rod_line", (1e-3, 2.0), "rod_volume", _LINE, _LITRES),
)


def _judged(draft: Draft, rows: tuple[Ratio, ...], place: Place, **part: Any) -> Findings:
    """Yield a warning for each ratio of a part that is out of its limits; `part` has its values and other quantities."""
    for row in rows:
        value, unit = part.get(row.key), part.get(row.by)
        if value and unit:
            here = place if rows is LINK else (*place, row.key)
            measured = part[row.measured] if row.measured else value
            texts = (row.where.format(**part), row.remedy)
            yield from draft.expect(here, value, row.limits, unit, *texts, measured=measured, says=row.says.format(**part))


def _between(value: float, limits: tuple[float, float], unit: float = 1.0) -> bool:
    return limits[0] * unit <= value <= limits[1] * unit


def density(scene: Scene) -> float | None:
    """Return the density of the material, kg/m^3; None if it does not fit E.

    A density that is not given is that of steel if E is that of steel, else None.
    """
    known, stiffness = scene.material.rho, scene.material.E
    if known is None:
        return STEEL if _between(stiffness, STEEL_E) else None
    return known if _between(stiffness, SPECIFIC_STIFFNESS, known) else None


def material(draft: Draft) -> Findings:
    """Check Young's modulus against the density."""
    steel_rho = (7700.0, 8000.0)  # densities that only steel has
    scene = draft.scene
    rho = scene.material.rho
    of_steel = 1.0 if rho is not None and _between(rho, steel_rho) else None
    yield from _judged(draft, MATERIAL, ("material",), E=scene.material.E, rho=rho, of_steel=of_steel)


def beams(draft: Draft) -> Findings:
    """Check all sections that have a beam."""
    scene = draft.scene
    box = 20.7  # the wall of a thin box is A^2/(I box) of its depth, DEPTH_BY_GYRATION radii of gyration
    rounded = 1.0 + 1e-3  # slack of a value that was rounded
    rho = density(scene)
    for i, section in enumerate(scene.sections):
        if section.beam is not None and section.A is not None and section.I is not None:
            radius = math.sqrt(section.I / section.A)
            thin_wall = 1e3 * DEPTH_BY_GYRATION * radius / box
            own = section.model_dump(include={"length", "height", "A", "I", "rho_A", "rho_I"})
            own |= {"radius": radius, "depth": DEPTH_BY_GYRATION * radius, "thin_wall": thin_wall}
            own |= {"wall": thin_wall * section.A**2 / section.I, "slack": (section.rho_A or 0.0) * rounded}
            own |= {} if rho is None else {"steel": rho * section.A, "rotary": rho * section.I}
            yield from _judged(draft, BEAM, ("sections", i), **own)
            yield from _ends(draft, i, section.length, section.beam)


def _ends(draft: Draft, i: int, length: float, beam: Point) -> Findings:
    longest_head = 0.125  # of the length
    least_beam = 0.6  # of the length
    place: Place = ("sections", i, "beam")
    (x0, x1), head = beam, length - beam[1]
    if x0 > 0.0 and x0 + x1 <= length * (1.0 + 1e-6) and head > longest_head * length:
        bound = f"[x0, x1] leave a rigid head of {head:.3g} m; expected at most {longest_head * length:.3g} m"
        remedy = f"x1 is measured from the inboard pivot; if {x1:g} m is the length of the beam, then x1 = {x0 + x1:g}."
        yield draft.warning(place, beam, bound, remedy)
    elif x1 - x0 < least_beam * length:
        bound = f"{x1 - x0:.3g} m bend of {length:g} m; expected at least {least_beam * length:.3g} m"
        yield draft.warning(place, beam, bound, "Give [x0, x1] from the inboard pivot: where the box begins and ends.")


def rigid_parts(draft: Draft) -> Findings:
    """Check roots and heads."""
    scene = draft.scene
    for i, section in enumerate(scene.sections):
        ends = section.beam or (section.length, section.length)
        for key, part, span in (("root", section.root, (0.0, ends[0])), ("head", section.head, (ends[1], section.length))):
            if part is not None and part.mass > 0.0:
                yield from _part(draft, ("sections", i, key), part, span)


def _part(draft: Draft, place: tuple[str, int, str], part: RigidPart, span: tuple[float, float]) -> Findings:
    """Check centre, inertia and mass: at least that of a share of as much beam, at most that of a solid block of its depth."""
    lightest_part, long_part = 0.2, 0.03  # of the beam's mass per metre, in parts longer than a share of the section
    beside = 2.0  # depths of the section, that a centre may lie beside its axis
    overhang = 0.05  # of the section's length, that a rigid part may reach beyond the pivots
    section, length = draft.scene.sections[place[1]], span[1] - span[0]
    depth = section.depth
    more = overhang * section.length
    low, high = span[0] - more, span[1] + more
    if not low <= part.com[0] <= high or abs(part.com[1]) > beside * depth:
        bound = f"expected inside the {place[2]}: x from {low:.3g} to {high:.3g} m, y within {beside * depth:.2g} m"
        remedy = "The centre of mass is measured from the INBOARD pivot, in the axes of the section."
        yield draft.warning((*place, "com"), part.com, bound, remedy)
        return
    own = {"length": length, "depth": depth, "radius": math.sqrt(part.inertia / part.mass)}
    own |= {"mass": part.mass, "inertia": part.inertia, "size": math.hypot(length + more, 2.0 * depth)}
    if length > long_part * section.length:
        own["lightest"] = lightest_part * (section.rho_A or 0.0) * length
    if (rho := density(draft.scene)) is not None:
        own["heaviest"] = rho * depth**2 * (length + 2.0 * depth)
    yield from _judged(draft, RIGID_PART, place, **own)


def moving_parts(draft: Draft) -> Findings:
    """Check links and cylinders."""
    scene = draft.scene
    for i, (section, joint) in enumerate(zip(scene.sections, scene.joints, strict=True)):
        root = 0.0 if section.root is None else section.root.mass
        per_metre = section.rho_A if section.rho_A is not None else root / section.length
        for key, mass, length in (("mL", joint.mL, joint.lL), ("mR", joint.mR, joint.lR)):
            if length:
                own = {"mass": mass, "length": length, "per_metre": per_metre, "beside": per_metre * length}
                yield from _judged(draft, LINK, ("joints", i, key), **own)
        yield from _cylinder(draft, i, joint.cylinder, per_metre, scene.sections[max(0, i - 1)].length)


def _cylinder(draft: Draft, i: int, cylinder: Cylinder, per_metre: float, carrier: float) -> Findings:
    place, closed = ("joints", i, "cylinder"), cylinder.closed_length
    size = {"closed_length": closed, "length": closed, "per_metre": per_metre, "beside": per_metre * closed}
    yield from _judged(draft, CYLINDER, place, **size, max_stroke=cylinder.max_stroke, carrier=carrier)
    for key, part in (("barrel", cylinder.barrel), ("rod", cylinder.rod)):
        if part is not None and part.mass > 0.0:
            own = size | part.model_dump() | {"radius": math.sqrt(part.inertia / part.mass)}
            yield from _judged(draft, CYLINDER_PART, (*place, key), **own)
    if (oil := cylinder.oil) is not None:
        volumes = {"cap_volume": oil.cap_area * cylinder.max_stroke, "rod_volume": oil.rod_area * cylinder.max_stroke}
        yield from _judged(draft, OIL, (*place, "oil"), **oil.model_dump(), **volumes)
