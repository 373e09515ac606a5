"""Geometric checks of a scene: pins and centres of mass on their parts; pins with clearance that are there and named once."""

from __future__ import annotations

import re

from ...config.yaml_text import Place
from ..schema import ContactLaw, Joint, Point, Section
from .draft import Draft, Findings

TOLERANCE = 1e-9
PLACES = {"cylinder": ("rod", "barrel"), "joint": ("pivot", "link_L", "link_R", "Q")}
NEAR_ENOUGH = 0.02  # between the restitution that is asked for and the one that a law gives
WIDE = 0.1  # of the pin's radius; contact of a journal in a bush is meant for much less


def placed_pins(draft: Draft) -> Findings:
    """Check that D is on the rigid head of the section before, E on the rigid root of its own, C near the section before."""
    for i, joint in enumerate(draft.joints):
        if i > 0 and joint is not None:
            before, own = draft.section(i - 1), draft.section(i)
            if before is not None:
                yield from _on_head(draft, i, joint, before)
                if joint.C is not None and _far(before.length, (before.length + joint.C[0], joint.C[1])):
                    bound = f"C lies far outside sections[{i - 1}], which is {before.length:g} m long"
                    remedy = "C is measured from the OUTBOARD pivot of the section before, so its x is negative."
                    yield draft.warning(("joints", i, "C"), joint.C, bound, remedy)
            if own is not None:
                yield from _on_root(draft, i, joint, own)


def _bending(draft: Draft, section: Section) -> Point | None:
    """Return the ends of the flexible part; None if the section is rigid, or the ends are wrong (another check says so)."""
    if section.beam is None or draft.modes_of(section) == 0:
        return None
    return section.beam if 0 <= section.beam[0] < section.beam[1] <= section.length else None


def _on_head(draft: Draft, i: int, joint: Joint, before: Section) -> Findings:
    beam = _bending(draft, before)
    if joint.D is None or beam is None:
        return
    first = beam[1] - before.length
    if joint.D[0] < first - TOLERANCE:
        bound = f"D must lie on the rigid head of sections[{i - 1}], x >= {first:.6g} m from its outboard pivot"
        remedy = f"Move D, or end the beam of sections[{i - 1}] at x1 <= {before.length + joint.D[0]:.6g} m."
        yield draft.fault(("joints", i, "D"), joint.D, bound, remedy)


def _on_root(draft: Draft, i: int, joint: Joint, own: Section) -> Findings:
    beam = _bending(draft, own)
    if joint.E is None or beam is None:
        return
    last = beam[0]
    if joint.E[0] > last + TOLERANCE:
        bound = f"E must lie on the rigid root of sections[{i}], x <= {last:.6g} m from its inboard pivot"
        remedy = f"Move E, or start the beam of sections[{i}] at x0 >= {joint.E[0]:.6g} m."
        yield draft.fault(("joints", i, "E"), joint.E, bound, remedy)


def thin_parts(draft: Draft) -> Findings:
    """Yield warnings of pins just beside an end of the beam, which cut off a sliver of it."""
    for i, section in enumerate(draft.sections):
        if section is None:
            continue
        following = draft.joints[i + 1] if i + 1 < len(draft.joints) else None
        if following is not None and following.C is not None:
            yield from _sliver(draft, section, ("joints", i + 1, "C"), following.C, section.length + following.C[0])
        if i == 0 and section.rod_pin is not None:
            yield from _sliver(draft, section, ("sections", i, "rod_pin"), section.rod_pin, section.rod_pin[0])


def _sliver(draft: Draft, section: Section, place: Place, value: Point, x: float) -> Findings:
    beam = _bending(draft, section)
    for end in beam or ():
        if beam and TOLERANCE < abs(x - end) < 0.01 * section.length and beam[0] < x < beam[1]:
            bound = f"the pin splits the beam {abs(x - end) * 1e3:.3g} mm from its end, at x = {end:g} m"
            yield draft.warning(place, value, bound, f"Let the beam end at the pin, x = {x:.6g} m, or move the pin.")


def centres(draft: Draft) -> Findings:
    """Check that centres of mass, and the rod pin, are near their section."""
    for i, section in enumerate(draft.sections):
        if section is None:
            continue
        for key in ("root", "head"):
            part = getattr(section, key)
            if part is not None and _far(section.length, part.com):
                bound = f"the centre lies far outside the section, which is {section.length:g} m long"
                remedy = "It is measured from the inboard pivot, along the section."
                yield draft.warning(("sections", i, key, "com"), part.com, bound, remedy)
        if section.rod_pin is not None and _far(section.length, section.rod_pin):
            bound = f"the pin lies far outside the section, which is {section.length:g} m long"
            remedy = "It is measured from the inboard pivot."
            yield draft.warning(("sections", i, "rod_pin"), section.rod_pin, bound, remedy)


def _far(length: float, point: tuple[float, float]) -> bool:
    """Return True if a point is more than a quarter of the length beyond the section's ends, or half of it beside."""
    return not -0.25 * length <= point[0] <= 1.25 * length or abs(point[1]) > 0.5 * length


# -- pins with clearance ----------------------------------------------------------------------------------------------


def worn_pins(draft: Draft) -> Findings:
    """Check that every pin of the block is a pin of the boom, named once, with a clearance that fits its radius."""
    if draft.clearance is None:
        return
    yield from _restitution(draft, draft.clearance.contact)
    seen: dict[str, int] = {}
    for i, pin in enumerate(draft.clearance.pins):
        place = ("clearance", "pins", i)
        there = [name for k, joint in enumerate(draft.joints) if joint is not None for name in names_of(k, joint)]
        if there and pin.at not in there and None not in draft.joints:
            yield draft.fault((*place, "at"), pin.at, *_unknown(pin.at, draft.joints, there))
        if pin.at in seen:
            bound = f"clearance.pins[{seen[pin.at]}] is this pin already"
            yield draft.fault((*place, "at"), pin.at, bound, "Give every pin once.")
        seen.setdefault(pin.at, i)
        share = pin.radial_clearance / pin.pin_radius
        if share >= 1.0:
            bound = f"it must be less than pin_radius = {pin.pin_radius:g} m"
            yield draft.fault((*place, "radial_clearance"), pin.radial_clearance, bound, "Give it in metres.")
        elif share > WIDE:
            bound = f"it is more than a tenth of pin_radius = {pin.pin_radius:g} m, for which the contact law is not meant"
            yield draft.warning((*place, "radial_clearance"), pin.radial_clearance, bound, "Give both in metres.")


def _restitution(draft: Draft, law: ContactLaw) -> Findings:
    """Yield a warning if a law does not keep the restitution it is given."""
    if "restitution" in law.model_fields_set and abs(law.given_restitution - law.restitution) > NEAR_ENOUGH:
        bound = f"the law {law.law} really gives {law.given_restitution:.3f}"
        remedy = "Take the law hunt-crossley-exact, which gives what is asked for."
        yield draft.warning(("clearance", "contact", "restitution"), law.restitution, bound, remedy)


def names_of(index: int, joint: Joint) -> list[str]:
    """Return all pins of joint `index` (0-based) and of its cylinder that can have clearance."""
    own = PLACES["joint"][:1] if joint.kind == "A" else PLACES["joint"]
    number = index + 1
    return [f"cylinder_{number}.{place}" for place in PLACES["cylinder"]] + [f"joint_{number}.{place}" for place in own]


def _unknown(at: str, joints: tuple[Joint | None, ...], there: list[str]) -> tuple[str, str]:
    """Return why there is no such pin, and the names that exist."""
    form = re.fullmatch(r"(cylinder|joint)_(\d+)\.(\w+)", at)
    if form is None or form[3] not in PLACES[form[1]]:
        return "not the name of a pin", "Write cylinder_i. with rod or barrel, or joint_i. with pivot, link_L, link_R or Q."
    number = int(form[2])
    if not 1 <= number <= len(joints):
        return f"the boom has joints and cylinders 1 to {len(joints)}", f"Give one of {', '.join(there)}."
    own = [name for name in there if name.split(".")[0] in (f"joint_{number}", f"cylinder_{number}")]
    return f"joint {number} is of kind A and has no links", f"Give one of {', '.join(own)}."
