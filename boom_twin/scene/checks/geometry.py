"""Geometry of a scene: pins on their parts; a joint over its range.

Over its range the links of a joint meet, its strokes are within reach and unique, it keeps clear of dead centres, and it holds
the named postures.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...config.yaml_text import Place
from ...types import Array
from ..kinematics import joint_curve, linkage
from ..schema import Joint, Point, Scene
from . import Draft, Findings

ROUNDING = 1e-9  # m, deg
RIGID = (math.inf, -math.inf)  # ends of the flexible part of a rigid section: every pin is on its root and on its head
TRANSMISSION_DEG = 5.0  # least angle between the links at Q; forces in them are then 11 times those across
LEVER = 0.25  # least lever ds/dphi over the largest; the cylinder's force is then 4 times the least one
MIRRORED = ("side", "cy", "dy", "ey", "left")  # numbers of a linkage that change their sign
UNMET = "the links lL and lR, between D and E, do not meet at"
NEXT_TO = "next to a dead centre"
Mask = NDArray[np.bool_]


def placed_pins(draft: Draft) -> Findings:
    """Check that D is on the rigid head of the section before, E on the rigid root of its own, C near the section before."""
    scene = draft.scene
    for i, joint in enumerate(scene.joints[1:], 1):
        assert joint.C is not None and joint.D is not None and joint.E is not None
        length, first, last = scene.sections[i - 1].length, _bending(scene, i - 1)[1], _bending(scene, i)[0]
        x, y = joint.C
        if not -1.25 * length <= x <= 0.25 * length or abs(y) > 0.5 * length:
            bound = f"C lies far outside sections[{i - 1}], which is {length:g} m long"
            remedy = "C is measured from the OUTBOARD pivot of the section before, so its x is negative."
            yield draft.warning(("joints", i, "C"), joint.C, bound, remedy)
        if joint.D[0] < first - length - ROUNDING:
            bound = f"D must lie on the rigid head of sections[{i - 1}], x >= {first - length:.6g} m from its outboard pivot"
            remedy = f"Move D, or end the beam of sections[{i - 1}] at x1 <= {length + joint.D[0]:.6g} m."
            yield draft.fault(("joints", i, "D"), joint.D, bound, remedy)
        if joint.E[0] > last + ROUNDING:
            bound = f"E must lie on the rigid root of sections[{i}], x <= {last:.6g} m from its inboard pivot"
            remedy = f"Move E, or start the beam of sections[{i}] at x0 >= {joint.E[0]:.6g} m."
            yield draft.fault(("joints", i, "E"), joint.E, bound, remedy)


def _bending(scene: Scene, i: int) -> Point:
    """Return the ends of the flexible part of section `i`; inf, -inf if it is rigid."""
    return scene.sections[i].beam or RIGID if scene.is_flexible(i) else RIGID


# -- a joint over its range -----------------------------------------------------------------------------------------------


def joints(draft: Draft) -> Findings:
    """Check every joint over its range_deg: closing, reach, uniqueness, and the named postures in it."""
    for i, joint in enumerate(draft.scene.joints):
        row = linkage(draft.scene, i)
        findings = list(_curve(draft, i, joint, row))
        yield from findings
        blocked = any(finding.kind == "fault" for finding in findings)
        for name, angles in draft.scene.postures.items():
            degrees = angles[i] - (angles[i - 1] if i > 0 else 0.0)
            yield from _posture(draft, (name, i), joint, degrees, None if blocked else row)


def _curve(draft: Draft, i: int, joint: Joint, row: np.record) -> Findings:
    """Check the cylinder's length over range_deg: faults if the joint is of no use at all, else one warning."""
    place: Place = ("joints", i, "range_deg")
    degrees = grid_of(joint)
    lengths = joint_curve(row, np.radians(degrees)).lengths
    if not np.isfinite(lengths).any():
        bound = f"{UNMET} any angle of it"
        remedy = f"Check D, E, lL and lR, their signs and their units: {_sizes_to_meet(row, degrees)}."
        yield draft.fault(place, joint.range_deg, bound, remedy)
        return
    shortest, longest = float(np.nanmin(lengths)), float(np.nanmax(lengths))
    if longest - shortest < 1e-6:
        bound = f"over it the cylinder stays {longest:.4g} m long, so it cannot turn the joint"
        remedy = "Check the pins: one of them lies on an axis of rotation."
        yield draft.fault(place, joint.range_deg, bound, remedy)
    elif not _reached(joint, lengths).any() and not np.isfinite(lengths).all():
        met = np.isfinite(lengths)
        bound = f"{UNMET} {intervals(degrees, ~met)}; where they do, at {intervals(degrees, met)}, the cylinder is not as long"
        yield draft.fault(place, joint.range_deg, bound, f"Change links or pins: {_sizes_to_meet(row, degrees)}.")
    elif not _reached(joint, lengths).any():
        remedy = "Give closed_length and max_stroke that cover this, or check the pins."
        place = ("joints", i, "cylinder", "closed_length")
        yield draft.fault(place, joint.cylinder.closed_length, _reach_words(joint, shortest, longest), remedy)
    else:
        yield from _narrower(draft, i, joint, row, degrees, lengths)


def grid_of(joint: Joint) -> Array:
    """Return the angles (deg) over the range of a joint."""
    step_deg = 0.1
    low, high = joint.range_deg
    return np.linspace(low, high, 1 + math.ceil((high - low) / step_deg))


def _narrower(draft: Draft, i: int, joint: Joint, row: np.record, degrees: Array, lengths: Array) -> Findings:
    """Yield one warning of all that a part of the range is not good for, with the part that is."""
    closed, reached = np.isfinite(lengths), _reached(joint, lengths)
    shortest, longest = float(np.nanmin(lengths)), float(np.nanmax(lengths))
    within = np.where(reached, lengths, np.nan)
    turns = _turns(within)
    tight, tight_words = _dead_centres(row, degrees, reached)
    reasons, remedies = [], []
    if not closed.all():
        reasons.append(f"{UNMET} {intervals(degrees, ~closed)}")
        remedies.append(f"change links or pins: {_sizes_to_meet(row, degrees)}")
    if (closed & ~reached).any():
        beyond = intervals(degrees, closed & ~reached)
        reasons.append(f"{_reach_words(joint, shortest, longest)}: stroke out of reach at {beyond}")
        if closed.all() and longest < 2.0 * shortest:
            closed_length = math.floor(1e3 * shortest) / 1e3
            max_stroke = math.ceil(1e3 * (longest - closed_length)) / 1e3
            remedies.append(f"give closed_length {closed_length:g} and max_stroke {max_stroke:g} m if the nameplate says so")
    if turns.size:
        angles = ", ".join(f"{degrees[k]:.1f}" for k in turns)
        reasons.append(f"the stroke turns back at {angles} deg: one stroke then belongs to two angles")
    remedies = [*filter(None, [_turned_over(joint, row, degrees) if reasons else ""]), *(remedies or ["check the pins"])]
    reasons = reasons or tight_words
    if reasons:
        remedy = ", or ".join([_narrow_words(joint, degrees, within, tight), *remedies])
        yield draft.warning(("joints", i, "range_deg"), joint.range_deg, "; ".join(reasons), f"{remedy}.")


def _dead_centres(row: np.record, degrees: Array, reached: Mask) -> tuple[Mask, list[str]]:
    """Return a mask of the angles next to a dead centre, and the sentences that say so."""
    open_deg = 15.0  # between the links, where the largest lever counts: next to a dead centre it grows beyond all bounds
    _, levers, between = joint_curve(row, np.radians(degrees))
    counted = levers[reached & (between >= open_deg)]
    largest = float(counted.max()) if counted.size else float(np.nanmax(np.where(reached, levers, np.nan), initial=0.0))
    flat, weak, told = reached & (between < TRANSMISSION_DEG), reached & (levers < LEVER * largest), []
    if flat.any():
        told.append(
            f"{NEXT_TO} of the links at {intervals(degrees, flat)}: they meet at {between[flat].min():.1f} deg; "
            f"expected at least {TRANSMISSION_DEG:g} deg, for forces in links and pins grow as 1/sin of that"
        )
    if weak.any():
        told.append(
            f"{NEXT_TO} of the cylinder at {intervals(degrees, weak)}: its lever ds/dphi is {levers[weak].min():.3g} m; "
            f"expected at least {LEVER * largest:.3g} m, a quarter of the largest, for its force grows as one over that"
        )
    return flat | weak, told


def _narrow_words(joint: Joint, degrees: Array, within: Array, tight: Mask) -> str:
    """Return the range that does, with what it keeps from dead centres where that is possible."""
    low, high = usable(degrees, np.where(tight, np.nan, within))
    if low >= high:
        return "Narrow range_deg to [{:g}, {:g}]".format(*usable(degrees, within))
    links = "" if joint.kind == "A" else f"at least {TRANSMISSION_DEG:g} deg between the links and "
    return f"Narrow range_deg to [{low:g}, {high:g}], which keeps {links}a quarter of the largest lever"


def _turned_over(joint: Joint, row: np.record, degrees: Array) -> str:
    """Return the remedy for a six-bar that does the whole range if it is the other way up; empty if it does not."""
    if joint.kind == "A":
        return ""
    side = "left" if joint.side == "right" else "right"
    for signs, words in ((("side",), ""), (MIRRORED, ", C, D, E and R with the other sign of their second number")):
        other = row.copy()
        for key in signs:
            other[key] = -other[key]
        lengths = joint_curve(other, np.radians(degrees)).lengths
        if np.isfinite(lengths).all() and not _turns(lengths).size:
            return f"give `side: {side}`{words}, if it folds that way"
    return ""


def _reach_words(joint: Joint, shortest: float, longest: float) -> str:
    closed, stroke = joint.cylinder.closed_length, joint.cylinder.max_stroke
    need = f"over range_deg the cylinder is {shortest:.4g} to {longest:.4g} m from pin to pin"
    return f"{need}, but it can be {closed:.4g} to {closed + stroke:.4g} m long"


def _sizes_to_meet(row: np.record, degrees: Array) -> str:
    """Return the link lengths that do not fit the distance of D and E over the range, in words."""
    apart = np.abs((row.ex + 1j * row.ey) * np.exp(1j * np.radians(degrees)) - (row.dx + 1j * row.dy))
    least, most = float(apart.min()), float(apart.max())
    total, difference = float(row.length_l + row.length_r), abs(float(row.length_l - row.length_r))
    needed = [f"lL + lR = {total:.4g} m must be more"] if total <= most else []
    needed += [f"|lL - lR| = {difference:.4g} m must be less"] if difference >= least else []
    return f"D and E are {least:.4g} to {most:.4g} m apart, {' and '.join(needed)}"


def _turns(lengths: Array) -> NDArray[np.int64]:
    slope = np.sign(np.diff(lengths))
    return np.flatnonzero(slope[1:] * slope[:-1] < 0) + 1


def usable(degrees: Array, lengths: Array) -> tuple[float, float]:
    """Return the longest part of the range (deg) in which lengths, NaN out of reach, grow or shrink; in whole degrees."""
    slope = np.nan_to_num(np.sign(np.diff(lengths)))
    edges = np.flatnonzero(np.diff(slope, prepend=2.0, append=2.0))
    first, last = max(
        ((start, stop) for start, stop in pairwise(edges) if slope[start] != 0.0),
        key=lambda part: int(part[1] - part[0]),
        default=(0, 0),
    )
    low, high = float(degrees[first]), float(degrees[last])
    whole_low = low if first == 0 else math.ceil(low)
    whole_high = high if last == len(degrees) - 1 else math.floor(high)
    return (whole_low, whole_high) if whole_low < whole_high else (low, high)


def _reached(joint: Joint, lengths: Array) -> Mask:
    """Return a mask of the angles at which the cylinder can be as long as the geometry asks; False where links do not meet."""
    strokes = lengths - joint.cylinder.closed_length
    return (strokes >= -ROUNDING) & (strokes <= joint.cylinder.max_stroke + ROUNDING)


def _posture(draft: Draft, who: tuple[str, int], joint: Joint, degrees: float, row: np.record | None) -> Findings:
    """Check joint `who[1]` in posture `who[0]`: its angle in range_deg and, if its geometry is known, its stroke."""
    name, i = who
    place, value = ("postures", name, i), draft.scene.postures[name][i]
    low, high = joint.range_deg
    says = f"posture `{name}` turns joint {i + 1} to {degrees:g} deg"
    if not low - ROUNDING <= degrees <= high + ROUNDING:
        bound = f"{says}, outside its range_deg [{low:g}, {high:g}]"
        remedy = "Change the posture or the range; a joint angle is the difference of neighbouring section angles."
        yield draft.fault(place, value, bound, remedy)
    elif row is not None:
        most = joint.cylinder.max_stroke
        stroke = float(joint_curve(row, np.radians(degrees)).lengths) - joint.cylinder.closed_length
        if math.isnan(stroke):
            yield draft.fault(place, value, f"{says}, where its links do not meet", "Change the posture or the links.")
        elif not -ROUNDING <= stroke <= most + ROUNDING:
            bound = f"{says}, a stroke of {stroke:.4g} m; cylinder {i + 1} has 0 to {most:g} m"
            yield draft.fault(place, value, bound, "Change the posture, closed_length or max_stroke.")


def intervals(degrees: Array, mask: Mask) -> str:
    """Return the intervals of a grid of angles in which a mask holds: ``-5 to 12.3 deg, 40 to 85 deg``."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    pairs = zip(edges[::2], edges[1::2] - 1, strict=True)
    return ", ".join(f"{degrees[first]:.1f} to {degrees[last]:.1f} deg" for first, last in pairs)
