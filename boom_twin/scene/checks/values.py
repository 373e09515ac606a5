"""Consistency checks of a scene's values: keys that need or exclude each other, and values that look like another unit."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from pydantic import BaseModel

from ...config.yaml_text import Place
from ...errors import ABSENT
from ..block_reader import meaning_of
from ..schema import Cylinder, Joint, Oil, Point, Section
from .draft import Draft, Findings

BEAM_NEEDS = ("A", "I", "rho_A")
BEAM_ONLY = ("A", "I", "rho_A", "rho_I", "beta", "height", "modes", "axial", "geometric", "head")
LINK_KEYS = ("C", "D", "E", "lL", "lR")
SIX_BAR_ONLY = (*LINK_KEYS, "side", "R", "mL", "mR")
NEEDED = {"A": (), "B1": LINK_KEYS, "B2": (*LINK_KEYS, "R"), "B3": (*LINK_KEYS, "R")}
"""Keys of a joint by its kind."""


def counts(draft: Draft) -> Findings:
    """Check that each section has one joint, and one angle in every posture."""
    number = len(draft.sections)
    if number == 0:
        return
    if draft.joints and len(draft.joints) != number:
        bound = f"there are {_several(number, 'section')}, and every section has one joint"
        yield draft.fault(("joints",), len(draft.joints), bound, "Add or remove joints or sections.")
    for name, angles in draft.postures.items():
        if len(angles) != number:
            bound = f"it has {_several(len(angles), 'angle')}, the boom has {_several(number, 'section')}"
            remedy = "Give one angle per section, degrees to the horizontal."
            yield draft.fault(("postures", name), angles, bound, remedy)


def sections(draft: Draft) -> Findings:
    """Check that flexible sections have their cross-section, rigid ones only a root, and the first one a rod pin."""
    for i, section in enumerate(draft.sections):
        if section is not None:
            yield from _rigid(draft, i, section) if section.beam is None else _flexible(draft, i, section, section.beam)
            yield from _rod_pin(draft, i, section)


def _flexible(draft: Draft, i: int, section: Section, beam: Point) -> Findings:
    place = ("sections", i)
    for key in BEAM_NEEDS:
        if getattr(section, key) is None:
            remedy = f"Give {key}, {meaning_of(Section, key)}, or leave out `beam` for a rigid section."
            yield draft.fault((*place, key), ABSENT, "a section with a beam needs it", remedy)
    x0, x1 = beam
    if not 0 <= x0 < x1 <= section.length:
        bound = f"[x0, x1] must have 0 <= x0 < x1 <= length = {section.length:g} m"
        yield draft.fault((*place, "beam"), beam, bound, "Both are measured from the inboard pivot.")


def _rigid(draft: Draft, i: int, section: Section) -> Findings:
    place = ("sections", i)
    if section.root is None:
        bound = "this section has no `beam`, so it is rigid, and `root` is all of it"
        yield draft.fault((*place, "root"), ABSENT, bound, "Give root: {mass, com, inertia}, or a beam.")
    elif section.root.mass == 0:
        bound = "this rigid section weighs nothing"
        yield draft.warning((*place, "root", "mass"), 0.0, bound, "Give its mass in kg.")
    for key in BEAM_ONLY:
        value = getattr(section, key)
        if value is not None:
            shown = value.model_dump() if key == "head" else value
            bound = "this section has no `beam`, so it is rigid, all of it described by `root`"
            remedy = f"Remove `{key}`, or give beam: [x0, x1] if the section bends."
            yield draft.fault((*place, key), shown, bound, remedy)


def _rod_pin(draft: Draft, i: int, section: Section) -> Findings:
    place = ("sections", i, "rod_pin")
    if i == 0 and section.rod_pin is None:
        bound = "cylinder 1 pushes on the first section and needs a pin there"
        yield draft.fault(place, ABSENT, bound, f"Give {meaning_of(Section, 'rod_pin')}.")
    if i > 0 and section.rod_pin is not None:
        bound = "only the first section has a rod pin; the later cylinders push on links"
        yield draft.fault(place, section.rod_pin, bound, f"Remove it; R in joints[{i}] places the pin on a link.")


def modes(draft: Draft) -> Findings:
    """Yield a warning of a single bending coordinate: a part then bends as under a constant moment only."""
    taking = [section for section in draft.sections if section is not None and section.beam is not None]
    places: list[Place] = [
        ("sections", i, "modes") for i, section in enumerate(draft.sections) if section in taking and section.modes == 1
    ]
    if draft.modes == 1 and any(section.modes is None for section in taking):
        places.insert(0, ("modes",))
    for place in places:
        bound = (
            "a part then bends to a circle only. With 1 in all sections of the default scene the deflection at rest is up to "
            "1.1 % off, frequencies 1 to 6 up to 9.9 %, and in its reference move the tip 7 mm and its acceleration 21 %"
        )
        yield draft.warning(place, 1, bound, "Take 2 or 3, or `boom_twin check --need` to see what can be left out.")


def joints(draft: Draft) -> Findings:
    """Check kinds in their order, with the keys of their kind and no others; angles and cylinders by themselves."""
    for i, joint in enumerate(draft.joints):
        if joint is not None:
            yield from _kind(draft, i, joint)
            yield from _keys_of_kind(draft, i, joint)
            yield from _range(draft, i, joint)
            yield from _oil_spring(draft, i, joint.cylinder)


def _kind(draft: Draft, i: int, joint: Joint) -> Findings:
    place = ("joints", i, "kind")
    if i == 0 and joint.kind != "A":
        bound = "joint 1 turns the boom on its base and must be of kind A"
        yield draft.fault(place, joint.kind, bound, "Put a joint of kind A first.")
    if i > 0 and joint.kind == "A":
        bound = "kind A stands on the base, so only joint 1 can be of it"
        yield draft.fault(place, joint.kind, bound, "Choose B1, B2 or B3.")


def _keys_of_kind(draft: Draft, i: int, joint: Joint) -> Findings:
    place = ("joints", i)
    refused = {"A": SIX_BAR_ONLY, "B1": ("R",)}.get(joint.kind, ())
    for key in NEEDED[joint.kind]:
        if getattr(joint, key) is None:
            remedy = f"Give {key}, {meaning_of(Joint, key)}."
            yield draft.fault((*place, key), ABSENT, f"a joint of kind {joint.kind} needs it", remedy)
    for key in refused:
        value = getattr(joint, key)
        if value is not None:
            why = "has no links" if joint.kind == "A" else "has its rod pin where the links meet"
            bound = f"a joint of kind {joint.kind} {why}"
            yield draft.fault((*place, key), value, bound, f"Remove `{key}`, or choose another kind.")


def _oil_spring(draft: Draft, i: int, cylinder: Cylinder) -> Findings:
    place, oil = ("joints", i, "cylinder"), cylinder.oil
    if cylinder.d is not None and not cylinder.is_compressible:
        bound = "a damper acts in parallel with the oil spring, and k is absent: the cylinder is incompressible"
        remedy = "Give k, stiffness of the oil spring in N/m, or remove d."
        yield draft.fault((*place, "d"), cylinder.d, bound, remedy)
    if oil is None:
        return
    if cylinder.k is not None:
        bound = f"the cylinder has k = {cylinder.k:g} N/m too, and its stiffness is either a number or that of the oil"
        yield draft.fault((*place, "oil"), oil.model_dump(), bound, "Remove k, or remove oil.")
    if oil.rod >= oil.bore:
        bound = f"the rod must be thinner than the bore, {oil.bore:g} m"
        yield draft.fault((*place, "oil", "rod"), oil.rod, bound, "Give both as diameters in m.")
    elif not ROD_BY_BORE[0] * oil.bore <= oil.rod <= ROD_BY_BORE[1] * oil.bore:
        low, high = (share * oil.bore for share in ROD_BY_BORE)
        bound = f"expected {low:.3g} to {high:.3g} m in a bore of {oil.bore:g} m"
        yield draft.warning((*place, "oil", "rod"), oil.rod, bound, "Give both as diameters in m, not one as a radius.")
    for key, end in (("cap_line", "stroke 0"), ("rod_line", f"its full stroke, {cylinder.max_stroke:g} m")):
        if getattr(oil, key) == 0.0:
            bound = f"no oil is left there at {end}, and the cylinder is incompressible"
            yield draft.warning((*place, "oil", key), 0.0, bound, f"Give {meaning_of(Oil, key)}: hoses and dead space.")


def _range(draft: Draft, i: int, joint: Joint) -> Findings:
    low, high = joint.range_deg
    if not -360 <= low < high <= 360:
        bound = "[low, high] must have -360 <= low < high <= 360 degrees"
        yield draft.fault(
            ("joints", i, "range_deg"), joint.range_deg, bound, "Give the lower angle first, both within one turn."
        )


def _several(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


LENGTHS = ("length", "beam", "height", "rod_pin", "com", "pivot", "cylinder_pin", "C", "D", "E", "R", "lL", "lR",
           "closed_length", "max_stroke")  # fmt: skip
ROD_BY_BORE = (0.4, 0.92)  # rods that may be pushed; the series of ISO 7181 has 0.45 to 0.89 for ratios of areas from 1.25 on
BULK = (4e8, 2.5e9)  # Pa; water has 2.2e9
TURNS = "the joint turns by"
NARROW = 25.0  # deg; joints of booms turn by 60 and more


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
    Suspect(("closed_length", "max_stroke"), 0.0, 50.0, "more than 50 m: mm?", "Give lengths in m."),
    Suspect(("cap_line", "rod_line"), 0.0, 0.5, "more than 0.5 m^3: litres?", "Give m^3: 1 litre is 1e-3."),
)  # fmt: skip
"""Values that look like another unit; the first that applies to a key is reported."""


def suspects(draft: Draft) -> Findings:
    """Check the size of all values of all usable parts."""
    blocks: list[tuple[Place, Any]] = [(("material",), draft.material), (("base",), draft.base), (("tip",), draft.tip)]
    blocks += [(("sections", i), section) for i, section in enumerate(draft.sections)]
    blocks += [(("joints", i), joint) for i, joint in enumerate(draft.joints)]
    for place, block in blocks:
        if block is not None:
            yield from _block(draft, place, block)
    if draft.line_fill is not None:
        yield from _value(draft, ("line_fill",), draft.line_fill)
    yield from _gravity(draft)
    yield from _postures(draft)


def _block(draft: Draft, place: Place, block: BaseModel) -> Findings:
    for key in type(block).model_fields:
        value, here = getattr(block, key), (*place, key)
        if isinstance(value, BaseModel):
            yield from _block(draft, here, value)
        elif value is not None:
            yield from _value(draft, here, value)


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
    if max(map(abs, value)) < 6.3:
        shown = ", ".join(f"{math.degrees(angle):.4g}" for angle in value)
        yield draft.warning(place, value, "all within 6.3: radians?", f"Give degrees; these radians would be [{shown}].")
    elif 0.0 < value[1] - value[0] < NARROW:
        bound = f"{TURNS} {value[1] - value[0]:.3g} deg in all; expected at least {NARROW:g} deg"
        yield draft.warning(place, value, bound, "Give the lowest and the highest joint angle in degrees; check the decimals.")


TILT = 1e-3  # of gravity against -y, rad


def _gravity(draft: Draft) -> Findings:
    if draft.gravity is not None:
        if not 9.7 < math.hypot(*draft.gravity) < 9.9:
            bound = "its size is not that of the earth's gravity, about 9.81 m/s^2"
            yield draft.warning(("gravity",), draft.gravity, bound, "Usual is [0.0, -9.81].")
        elif draft.gravity[1] > 0:
            yield draft.warning(("gravity",), draft.gravity, "it points upwards", "Usual is [0.0, -9.81].")
        elif abs(draft.gravity[0]) > TILT * abs(draft.gravity[1]):
            bound = "it does not point along -y, which is down"
            yield draft.warning(("gravity",), draft.gravity, bound, "Give [0.0, -9.81]; a slope is base.inclination, rad.")


def _postures(draft: Draft) -> Findings:
    for name, angles in draft.postures.items():
        if angles and max(map(abs, angles)) < 6.3 and any(angle != round(angle) for angle in angles):
            yield draft.warning(("postures", name), angles, "all within 6.3: radians?", "Give degrees to the horizontal.")
