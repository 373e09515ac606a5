"""Consistency of a scene's values: keys that need or exclude each other, counts, pins with clearance that are there."""

from __future__ import annotations

import math
import re

from ...errors import ABSENT
from ...system.terminal_text import several
from ..block_reader import meaning_of
from ..schema import Base, Cylinder, Joint, Oil, Point, Section
from . import Draft, Findings

BEAM_NEEDS = ("A", "I", "rho_A")
BEAM_ONLY = ("A", "I", "rho_A", "rho_I", "beta", "height", "modes", "axial", "geometric", "head")
LINK_KEYS = ("C", "D", "E", "lL", "lR")
SIX_BAR_ONLY = (*LINK_KEYS, "side", "R", "mL", "mR")
NEEDED = {"A": (), "B1": LINK_KEYS, "B2": (*LINK_KEYS, "R"), "B3": (*LINK_KEYS, "R")}
"""Keys of a joint by its kind."""
PLACES = {"cylinder": ("rod", "barrel"), "joint": ("pivot", "link_L", "link_R", "Q")}


def counts(draft: Draft) -> Findings:
    """Check that each section has one joint, and one angle in every posture."""
    number = len(draft.scene.sections)
    if len(draft.scene.joints) != number:
        bound = f"there are {several(number, 'section')}, and every section has one joint"
        yield draft.fault(("joints",), len(draft.scene.joints), bound, "Add or remove joints or sections.")
    for name, angles in draft.scene.postures.items():
        if len(angles) != number:
            bound = f"it has {several(len(angles), 'angle')}, the boom has {several(number, 'section')}"
            remedy = "Give one angle per section, degrees to the horizontal."
            yield draft.fault(("postures", name), angles, bound, remedy)


def sections(draft: Draft) -> Findings:
    """Check that flexible sections have their cross-section, rigid ones only a root, and the first one a rod pin."""
    for i, section in enumerate(draft.scene.sections):
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


def joints(draft: Draft) -> Findings:
    """Check kinds in their order, with the keys of their kind and no others; angles and cylinders by themselves."""
    for i, joint in enumerate(draft.scene.joints):
        yield from _kind(draft, i, joint)
        yield from _keys_of_kind(draft, i, joint)
        yield from _range(draft, i, joint)
        yield from _oil_spring(draft, i, joint.cylinder)


def base(draft: Draft) -> Findings:
    """Check that the damper of the base's hinge has its spring."""
    own = draft.scene.base
    if own.damping is not None and own.stiffness is None:
        bound = "a damper acts in parallel with the hinge's spring, and stiffness is absent: the base is rigid"
        remedy = f"Give stiffness, {meaning_of(Base, 'stiffness')}, or remove damping."
        yield draft.fault(("base", "damping"), own.damping, bound, remedy)


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
    rod_by_bore = (0.4, 0.92)  # ISO 7181 has 0.45 to 0.89 for ratios of areas from 1.25 on
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
    else:
        where, remedy = f" m in a bore of {oil.bore:g} m", "Give both as diameters in m, not one as a radius."
        yield from draft.expect((*place, "oil", "rod"), oil.rod, rod_by_bore, oil.bore, where, remedy)
    for key, end in (("cap_line", "stroke 0"), ("rod_line", f"its full stroke, {cylinder.max_stroke:g} m")):
        if getattr(oil, key) == 0.0:
            bound = f"no oil is left there at {end}, and the cylinder is incompressible"
            yield draft.warning((*place, "oil", key), 0.0, bound, f"Give {meaning_of(Oil, key)}: hoses and dead space.")


def _range(draft: Draft, i: int, joint: Joint) -> Findings:
    place, (low, high) = ("joints", i, "range_deg"), joint.range_deg
    if not -360 <= low < high <= min(360, low + 360):
        bound = "[low, high] must have -360 <= low < high <= 360 degrees, and high - low <= 360 degrees"
        yield draft.fault(place, joint.range_deg, bound, "Give the lower angle first, both within one turn.")
    elif max(abs(low), abs(high)) < 2.0 * math.pi:
        shown = ", ".join(f"{math.degrees(angle):.4g}" for angle in joint.range_deg)
        bound = "both are within 6.28 degrees, and joints of booms turn further: radians?"
        yield draft.fault(place, joint.range_deg, bound, f"Give degrees; these radians would be [{shown}].")


def worn_pins(draft: Draft) -> Findings:
    """Check that every pin of the block is a pin of the boom, named once, with a clearance that fits its radius."""
    wide_clearance = 0.1  # of the pin's radius; contact of a journal in a bush is meant for much less
    near_restitution = 0.02  # between the restitution that is asked for and the one that a law gives
    scene, block = draft.scene, draft.scene.clearance
    if block is None:
        return
    law = block.contact
    if "restitution" in law.model_fields_set and abs(law.given_restitution - law.restitution) > near_restitution:
        bound = f"the law {law.law} really gives {law.given_restitution:.3f}"
        remedy = "Take the law hunt-crossley-exact, which gives what is asked for."
        yield draft.warning(("clearance", "contact", "restitution"), law.restitution, bound, remedy)
    there = [name for k, joint in enumerate(scene.joints) for name in names_of(k, joint)]
    seen: dict[str, int] = {}
    for i, pin in enumerate(block.pins):
        place = ("clearance", "pins", i)
        if pin.at not in there:
            yield draft.fault((*place, "at"), pin.at, *_unknown(pin.at, len(scene.joints), there))
        if pin.at in seen:
            bound = f"clearance.pins[{seen[pin.at]}] is this pin already"
            yield draft.fault((*place, "at"), pin.at, bound, "Give every pin once.")
        seen.setdefault(pin.at, i)
        share = pin.radial_clearance / pin.pin_radius
        if share >= 1.0:
            bound = f"it must be less than pin_radius = {pin.pin_radius:g} m"
            yield draft.fault((*place, "radial_clearance"), pin.radial_clearance, bound, "Give it in metres.")
        elif share > wide_clearance:
            bound = f"it is more than a tenth of pin_radius = {pin.pin_radius:g} m, for which the contact law is not meant"
            yield draft.warning((*place, "radial_clearance"), pin.radial_clearance, bound, "Give both in metres.")


def names_of(index: int, joint: Joint) -> list[str]:
    """Return all pins of joint `index` (0-based) and of its cylinder that can have clearance."""
    own = PLACES["joint"][:1] if joint.kind == "A" else PLACES["joint"]
    number = index + 1
    return [f"cylinder_{number}.{place}" for place in PLACES["cylinder"]] + [f"joint_{number}.{place}" for place in own]


def _unknown(at: str, joints: int, there: list[str]) -> tuple[str, str]:
    """Return why there is no such pin, and the names that exist."""
    form = re.fullmatch(r"(cylinder|joint)_(\d+)\.(\w+)", at)
    if form is None or form[3] not in PLACES[form[1]]:
        return "not the name of a pin", "Write cylinder_i. with rod or barrel, or joint_i. with pivot, link_L, link_R or Q."
    number = int(form[2])
    if not 1 <= number <= joints:
        return f"the boom has joints and cylinders 1 to {joints}", f"Give one of {', '.join(there)}."
    own = [name for name in there if name.split(".")[0] in (f"joint_{number}", f"cylinder_{number}")]
    return f"joint {number} is of kind A and has no links", f"Give one of {', '.join(own)}."
