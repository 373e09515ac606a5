"""Pins with clearance: that they are there, named once, and of a size that can be."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..schema import ContactLaw, Joint
from .draft import Draft, Finding, fault, warning

PLACES = {"cylinder": ("rod", "barrel"), "joint": ("pivot", "link_L", "link_R", "Q")}
NEAR_ENOUGH = 0.02  # between the restitution that is asked for and the one that a law gives
WIDE = 0.1  # of the pin's radius; contact of a journal in a bush is meant for much less


def pins(draft: Draft) -> Iterator[Finding]:
    """Every pin of the block names a pin of the boom, and its clearance fits its radius."""
    if draft.clearance is None:
        return
    yield from _restitution(draft, draft.clearance.contact)
    seen: dict[str, int] = {}
    for i, pin in enumerate(draft.clearance.pins):
        place = ("clearance", "pins", i)
        there = [name for k, joint in enumerate(draft.joints) if joint is not None for name in names_of(k, joint)]
        if there and pin.at not in there and None not in draft.joints:
            yield fault(draft, (*place, "at"), pin.at, *_unknown(pin.at, draft.joints, there))
        if pin.at in seen:
            bound = f"clearance.pins[{seen[pin.at]}] is this pin already"
            yield fault(draft, (*place, "at"), pin.at, bound, "Give every pin once.")
        seen.setdefault(pin.at, i)
        share = pin.radial_clearance / pin.pin_radius
        if share >= 1.0:
            bound = f"it must be less than pin_radius = {pin.pin_radius:g} m"
            yield fault(draft, (*place, "radial_clearance"), pin.radial_clearance, bound, "Give it in metres.")
        elif share > WIDE:
            bound = f"it is more than a tenth of pin_radius = {pin.pin_radius:g} m, for which the contact law is not meant"
            yield warning(draft, (*place, "radial_clearance"), pin.radial_clearance, bound, "Give both in metres.")


def _restitution(draft: Draft, law: ContactLaw) -> Iterator[Finding]:
    """A law that does not keep the restitution it is given."""
    if "restitution" in law.model_fields_set and abs(law.given_restitution - law.restitution) > NEAR_ENOUGH:
        bound = f"the law {law.law} really gives {law.given_restitution:.3f}"
        remedy = "Take the law hunt-crossley-exact, which gives what is asked for."
        yield warning(draft, ("clearance", "contact", "restitution"), law.restitution, bound, remedy)


def names_of(index: int, joint: Joint) -> list[str]:
    """All pins of joint `index` (0-based) and of its cylinder that can have clearance."""
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
