"""Geometric checks of a scene: pins and centres of mass on their parts."""

from __future__ import annotations

from collections.abc import Iterator

from ...config.yaml_text import Place
from ..schema import Joint, Point, Section
from .draft import Draft, Finding, fault, warning

TOLERANCE = 1e-9


def pins(draft: Draft) -> Iterator[Finding]:
    """Check that D is on the rigid head of the section before, E on the rigid root of its own, C near the section before."""
    for i, joint in enumerate(draft.joints):
        if i > 0 and joint is not None:
            before, own = draft.section(i - 1), draft.section(i)
            if before is not None:
                yield from _on_head(draft, i, joint, before)
                yield from _c_nearby(draft, i, joint, before)
            if own is not None:
                yield from _on_root(draft, i, joint, own)


def _bending(draft: Draft, section: Section) -> Point | None:
    """Ends of the flexible part; None if the section is rigid, or the ends are wrong (another check says so)."""
    if section.beam is None or draft.modes_of(section) == 0:
        return None
    return section.beam if 0 <= section.beam[0] < section.beam[1] <= section.length else None


def _on_head(draft: Draft, i: int, joint: Joint, before: Section) -> Iterator[Finding]:
    beam = _bending(draft, before)
    if joint.D is None or beam is None:
        return
    first = beam[1] - before.length
    if joint.D[0] < first - TOLERANCE:
        bound = f"D must lie on the rigid head of sections[{i - 1}], x >= {first:.6g} m from its outboard pivot"
        remedy = f"Move D, or end the beam of sections[{i - 1}] at x1 <= {before.length + joint.D[0]:.6g} m."
        yield fault(draft, ("joints", i, "D"), joint.D, bound, remedy)


def _on_root(draft: Draft, i: int, joint: Joint, own: Section) -> Iterator[Finding]:
    beam = _bending(draft, own)
    if joint.E is None or beam is None:
        return
    last = beam[0]
    if joint.E[0] > last + TOLERANCE:
        bound = f"E must lie on the rigid root of sections[{i}], x <= {last:.6g} m from its inboard pivot"
        remedy = f"Move E, or start the beam of sections[{i}] at x0 >= {joint.E[0]:.6g} m."
        yield fault(draft, ("joints", i, "E"), joint.E, bound, remedy)


def _c_nearby(draft: Draft, i: int, joint: Joint, before: Section) -> Iterator[Finding]:
    if joint.C is not None and _far(before.length, (before.length + joint.C[0], joint.C[1])):
        bound = f"C lies far outside sections[{i - 1}], which is {before.length:g} m long"
        remedy = "C is measured from the OUTBOARD pivot of the section before, so its x is negative."
        yield warning(draft, ("joints", i, "C"), joint.C, bound, remedy)


def thin_parts(draft: Draft) -> Iterator[Finding]:
    """Yield warnings of pins just beside an end of the beam, which cut off a sliver of it."""
    for i, section in enumerate(draft.sections):
        if section is None:
            continue
        following = draft.joints[i + 1] if i + 1 < len(draft.joints) else None
        if following is not None and following.C is not None:
            yield from _sliver(draft, section, ("joints", i + 1, "C"), following.C, section.length + following.C[0])
        if i == 0 and section.rod_pin is not None:
            yield from _sliver(draft, section, ("sections", i, "rod_pin"), section.rod_pin, section.rod_pin[0])


def _sliver(draft: Draft, section: Section, place: Place, value: Point, x: float) -> Iterator[Finding]:
    beam = _bending(draft, section)
    for end in beam or ():
        if beam and TOLERANCE < abs(x - end) < 0.01 * section.length and beam[0] < x < beam[1]:
            bound = f"the pin splits the beam {abs(x - end) * 1e3:.3g} mm from its end, at x = {end:g} m"
            yield warning(draft, place, value, bound, f"Let the beam end at the pin, x = {x:.6g} m, or move the pin.")


def centres(draft: Draft) -> Iterator[Finding]:
    """Check that centres of mass, and the rod pin, are near their section."""
    for i, section in enumerate(draft.sections):
        if section is None:
            continue
        for key in ("root", "head"):
            part = getattr(section, key)
            if part is not None and _far(section.length, part.com):
                bound = f"the centre lies far outside the section, which is {section.length:g} m long"
                remedy = "It is measured from the inboard pivot, along the section."
                yield warning(draft, ("sections", i, key, "com"), part.com, bound, remedy)
        if section.rod_pin is not None and _far(section.length, section.rod_pin):
            bound = f"the pin lies far outside the section, which is {section.length:g} m long"
            remedy = "It is measured from the inboard pivot."
            yield warning(draft, ("sections", i, "rod_pin"), section.rod_pin, bound, remedy)


def _far(length: float, point: tuple[float, float]) -> bool:
    """Return True if a point is more than a quarter of the length beyond the section's ends, or half of it beside."""
    return not -0.25 * length <= point[0] <= 1.25 * length or abs(point[1]) > 0.5 * length
