"""Geometric checks of a scene: points on their parts, link closure, strokes and postures within reach."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...kernels.elements.linkage import cylinder_length
from ...types import Array
from ..kinematics import linkage_of
from ..schema import Joint, Point, Section
from ..yaml_reader import Place
from .findings import Draft, Finding, fault, warning
from .values import NEEDED

TOLERANCE = 1e-9


def pins(draft: Draft) -> Iterator[Finding]:
    """D on the rigid head of the section before, E on the rigid root of its own, C near the section before."""
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
    """Pins just beside an end of the beam, which cut off a sliver of it."""
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
    """Centres of mass, and the rod pin, near their section."""
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
    """Whether a point is more than a quarter of the length beyond the section's ends, or half of it beside."""
    return not -0.25 * length <= point[0] <= 1.25 * length or abs(point[1]) > 0.5 * length


STEP_DEG = 0.1
Mask = NDArray[np.bool_]


def joints(draft: Draft) -> Iterator[Finding]:
    """Every joint with its range_deg: closing, reach and uniqueness over it, and the named postures in it."""
    for i, joint in enumerate(draft.joints):
        if joint is None or not -360 <= joint.range_deg[0] < joint.range_deg[1] <= 360:
            continue
        row = _geometry(draft, i)
        findings = [] if row is None else list(_curve(draft, i, joint, row))
        yield from findings
        blocked = row is None or any(not finding.odd for finding in findings)
        for name, degrees in _postures(draft, i):
            yield from _posture(draft, (name, i), joint, degrees, None if blocked else row)


def _curve(draft: Draft, i: int, joint: Joint, row: np.record) -> Iterator[Finding]:
    """The cylinder's length over range_deg."""
    low, high = joint.range_deg
    degrees = np.linspace(low, high, 1 + math.ceil((high - low) / STEP_DEG))
    with np.errstate(invalid="ignore"):
        lengths = cylinder_length(row, np.radians(degrees))[0]
    closed = np.isfinite(lengths)
    yield from _closing(draft, i, joint, degrees, closed)
    if closed.any():
        reached = _reached(joint, lengths)
        yield from _strokes(draft, i, joint, degrees, lengths, reached)
        yield from _turning(draft, i, joint, degrees, np.where(reached, lengths, np.nan))


def _geometry(draft: Draft, i: int) -> np.record | None:
    """Geometry of joint `i`; None if it is not complete."""
    joint, first = draft.joints[i], draft.section(0)
    if joint is None or (i == 0) != (joint.kind == "A"):
        return None
    if joint.kind == "A":
        complete = draft.base is not None and first is not None and first.rod_pin is not None
    else:
        complete = all(getattr(joint, key) is not None for key in NEEDED[joint.kind])
    return linkage_of(joint, draft.base, first) if complete else None


def _closing(draft: Draft, i: int, joint: Joint, degrees: Array, closed: Mask) -> Iterator[Finding]:
    if closed.all():
        return
    place = ("joints", i, "range_deg")
    if not closed.any():
        bound = "the links lL and lR, between D and E, do not meet at any angle of it"
        remedy = "Check D, E, lL and lR, their signs and their units."
        yield fault(draft, place, joint.range_deg, bound, remedy)
    else:
        bound = f"the links lL and lR, between D and E, do not meet at {intervals(degrees, ~closed)}"
        yield warning(draft, place, joint.range_deg, bound, f"They meet at {intervals(degrees, closed)}: narrow the range.")


def _reached(joint: Joint, lengths: Array) -> Mask:
    """Where the cylinder can be as long as the geometry asks; False where links do not meet."""
    strokes = lengths - joint.cylinder.closed_length
    return (strokes >= -TOLERANCE) & (strokes <= joint.cylinder.max_stroke + TOLERANCE)


def _strokes(draft: Draft, i: int, joint: Joint, degrees: Array, lengths: Array, reached: Mask) -> Iterator[Finding]:
    cylinder = joint.cylinder
    shortest, longest = float(np.nanmin(lengths)), float(np.nanmax(lengths))
    need = f"over range_deg the cylinder is {shortest:.4g} to {longest:.4g} m from pin to pin"
    have = f"it can be {cylinder.closed_length:.4g} to {cylinder.closed_length + cylinder.max_stroke:.4g} m long"
    beyond = np.isfinite(lengths) & ~reached
    if longest - shortest < 1e-6:
        bound = f"over it the cylinder stays {longest:.4g} m long, so it cannot turn the joint"
        remedy = "Check the pins: one of them lies on an axis of rotation."
        yield fault(draft, ("joints", i, "range_deg"), joint.range_deg, bound, remedy)
    elif not reached.any():
        remedy = "Give closed_length and max_stroke that cover this, or check the pins."
        place = ("joints", i, "cylinder", "closed_length")
        yield fault(draft, place, cylinder.closed_length, f"{need}, but {have}", remedy)
    elif beyond.any():
        bound = f"{need}, but {have}: stroke out of reach at {intervals(degrees, beyond)}"
        within = intervals(degrees, reached)
        remedy = f"Within reach at {within}: narrow range_deg, or mend closed_length and max_stroke."
        yield warning(draft, ("joints", i, "range_deg"), joint.range_deg, bound, remedy)


def _turning(draft: Draft, i: int, joint: Joint, degrees: Array, lengths: Array) -> Iterator[Finding]:
    """Where the length, NaN out of reach, stops growing or shrinking."""
    slope = np.sign(np.diff(lengths))
    turns = np.flatnonzero(slope[1:] * slope[:-1] < 0) + 1
    if turns.size:
        angles = ", ".join(f"{degrees[k]:.1f}" for k in turns)
        bound = f"the stroke turns back at {angles} deg: one stroke then belongs to two angles"
        remedy = "Narrow the range to one side, or check the pins."
        yield warning(draft, ("joints", i, "range_deg"), joint.range_deg, bound, remedy)


def _postures(draft: Draft, i: int) -> Iterator[tuple[str, float]]:
    """Names of the complete postures, and the angle (deg) at which each holds joint `i`."""
    for name, angles in draft.postures.items():
        if len(angles) == len(draft.joints):
            yield name, angles[i] - (angles[i - 1] if i > 0 else 0.0)


def _posture(draft: Draft, who: tuple[str, int], joint: Joint, degrees: float, row: np.record | None) -> Iterator[Finding]:
    """Joint `who[1]` in posture `who[0]`: its angle in range_deg and, where its geometry is known, its stroke."""
    name, i = who
    place, value = ("postures", name, i), draft.postures[name][i]
    low, high = joint.range_deg
    says = f"posture `{name}` turns joint {i + 1} to {degrees:g} deg"
    if not low - TOLERANCE <= degrees <= high + TOLERANCE:
        bound = f"{says}, outside its range_deg [{low:g}, {high:g}]"
        remedy = "Change the posture or the range; a joint angle is the difference of neighbouring section angles."
        yield fault(draft, place, value, bound, remedy)
    elif row is not None:
        most = joint.cylinder.max_stroke
        with np.errstate(invalid="ignore"):
            stroke = float(cylinder_length(row, math.radians(degrees))[0]) - joint.cylinder.closed_length
        if math.isnan(stroke):
            yield fault(draft, place, value, f"{says}, where its links do not meet", "Change the posture or the links.")
        elif not -TOLERANCE <= stroke <= most + TOLERANCE:
            bound = f"{says}, a stroke of {stroke:.4g} m; cylinder {i + 1} has 0 to {most:g} m"
            yield fault(draft, place, value, bound, "Change the posture, closed_length or max_stroke.")


def intervals(degrees: Array, mask: Mask) -> str:
    """Where on a grid of angles a mask holds: ``-5 to 12.3 deg, 40 to 85 deg``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    pairs = zip(edges[::2], edges[1::2] - 1, strict=True)
    return ", ".join(f"{degrees[first]:.1f} to {degrees[last]:.1f} deg" for first, last in pairs)
