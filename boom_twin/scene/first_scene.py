"""A first scene from a table of the drawing: every computed value has its formula beside it.

Values that no drawing gives (rigid ends, barrels, rods, damping) are estimates, and marked as such. The damping needs the
first natural frequency, which `boom_twin.scene.checks.whole_boom` estimates.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..config.yaml_text import Document, Place, yaml_text
from ..errors import ABSENT, Fault, SceneError
from ..types import Array
from .boom_table import BoomTable, BoxSection, DrawnJoint, odd_boxes, second_moment
from .checks.geometry import NEXT_TO
from .checks.sizes import TURNS
from .checks.whole_boom import straight_boom
from .kinematics import RANGE_SAMPLES, joint_curve, linkage_of, stroke_curve
from .load import examine_text, with_end_mark
from .schema import Cylinder, JointGeometry, Oil, Scene, Section

TUBE = 0.12  # wall of a barrel over its bore
SPARE = 0.02  # of the travel, at each end of the stroke
RANGE = re.compile(r"joints\[\d+\]\.range_deg")


def first_scene(table: BoomTable, document: Document, source: str) -> tuple[str, Scene, list[Fault]]:
    """Return the scene's text, the scene, and its warnings at the table's keys and lines.

    SceneError if the boom of the table cannot be: joints that do not reach all of their ranges, postures out of reach.
    """
    text, scene, faults, odd = _examined(table, source)
    narrower = [each for each in odd if RANGE.fullmatch(each.path) and not each.bound.startswith((NEXT_TO, TURNS))]
    if narrower:  # a fault here: the stroke and the postures that are worked out hang on the range
        odd = [each for each in odd if each not in narrower]
        faults = narrower + [each for each in faults if table.postures or not each.path.startswith("postures")]
    boxes, told = odd_boxes(table, document), in_table(odd, document)
    lying = {each.path.rpartition(".")[0] for each in boxes if each.path.endswith("height")}  # their second moments are odd too
    told = [each for each in told if each.path.rpartition(".")[0] not in lying]
    known = {each.path.rpartition(".")[0] for each in told}
    oddities = [*told, *(each for each in boxes if each.path.rpartition(".")[0] not in known)]
    oddities.sort(key=lambda each: each.line or 0)
    if faults or scene is None:
        raise SceneError(source, tuple(in_table(faults, document)), tuple(oddities))
    return text, scene, oddities


def _examined(table: BoomTable, source: str) -> tuple[str, Scene | None, list[Fault], list[Fault]]:
    """Return the scene's text, the scene (None if it cannot be used), its faults and its warnings."""
    try:
        scene, _ = examine_text(_text(table, source, None), source)
        found = straight_boom(scene, _straight_stiffnesses(scene))
        text = _text(table, source, float(found.frequencies[0]) if len(found.frequencies) else None)
        scene, odd = examine_text(text, source)
        return text, scene, [], odd
    except SceneError as error:
        return "", None, list(error.faults), list(error.oddities)


def _straight_stiffnesses(scene: Scene) -> Array:
    """Return the stiffness (N/m) of every cylinder, shape (n,), where its joint is straight, or next to it."""
    angles = [np.radians([np.clip(0.0, *joint.range_deg)]) for joint in scene.joints]
    strokes = [float(stroke_curve(scene, i, angle)[0]) for i, angle in enumerate(angles)]
    return np.array([joint.cylinder.stiffness(stroke) for joint, stroke in zip(scene.joints, strokes, strict=True)])


def _text(table: BoomTable, source: str, first: float | None) -> str:
    """Return the text of the scene; without damping if the `first` natural frequency (Hz) is not known yet."""
    lines = [f"# Worked out by `boom_twin init` from {source}. SI units: m, kg, s, N, Pa; range_deg and postures in degrees."]
    lines += ["# [estimate]: a guess where the drawing tells nothing. Weigh, measure or test, and write what you find."]
    lines += [f"description: {yaml_text(table.description)}"] if table.description else []
    material = {key: value for key, value in table.material.model_dump().items() if value is not None}
    lines += ["gravity: [0.0, -9.81]", f"material: {yaml_text(material)}", "", "base:"]
    lines += [f"  pivot: {yaml_text(table.base.pivot)}", f"  cylinder_pin: {yaml_text(table.base.cylinder_pin)}"]
    rest = table.base.model_dump(exclude={"pivot", "cylinder_pin"}, exclude_defaults=True)
    lines += [f"  {key}: {yaml_text(value)}" for key, value in rest.items()]
    lines += ["", "sections:"]
    for number, section in enumerate(table.sections, 1):
        lines += [f"  # section {number}: a box {section.height:g} x {section.width:g} m, walls {section.wall:g} m"]
        lines += _item(_section(table, section, first))
    lines += ["", "joints:"]
    for i, joint in enumerate(table.joints):
        lines += [f"  # joint {i + 1}: bore {joint.bore:g} m, rod {joint.rod:g} m", *_item(_joint(table, joint, first))]
    lines += ["", f"tip: {{payload: {yaml_text(table.payload)}}}"] if table.payload else []
    lines += [f"line_fill: {yaml_text(table.line_fill)}"] if table.line_fill else []
    return with_end_mark("\n".join([*lines, "", *_postures(table)]))


Row = tuple[str, Any, str]  # key, value, comment


def _section(table: BoomTable, section: BoxSection, first: float | None) -> list[Row]:
    h, b, t, rho = section.height, section.width, section.wall, table.material.rho or 0.0
    area = h * b - (h - 2 * t) * (b - 2 * t)
    inertia = second_moment(h, b, t)
    pipe = table.pipe if section.pipe is None else section.pipe
    per_metre = rho * area + pipe
    rows = [
        ("length", section.length, "pivot to pivot"),
        ("beam", section.beam, "the box that bends, from the inboard pivot"),
        ("height", h, "outer height h; section modulus 2 I / h"),
        ("A", area, f"h b - (h - 2 t)(b - 2 t), b = {b:g}, t = {t:g}"),
        ("I", inertia, "[b h^3 - (b - 2 t)(h - 2 t)^3] / 12"),
        ("rho_A", per_metre, f"rho A + pipe = {rho:g} A + {pipe:g}"),
        ("rho_I", rho * inertia, "rho I"),
    ]
    if first is not None:
        formula = f"[estimate] 2 zeta / omega, zeta = {table.damping_ratio:g}, omega = 2 pi {first:.3g} Hz"
        rows.append(("beta", _delay(table, first), formula))
    x0, x1 = section.beam
    for key, start, stop in (("root", 0.0, x0), ("head", x1, section.length)):
        if stop - start > 1e-6 * section.length:
            rows.append((key, *_end(per_metre, start, stop, h)))
    return rows + ([("rod_pin", section.rod_pin, "")] if section.rod_pin is not None else [])


def _end(per_metre: float, start: float, stop: float, height: float) -> tuple[dict[str, Any], str]:
    ends = 1.2  # mass per metre of a rigid end against the beam's
    length = stop - start
    mass = ends * per_metre * length
    values = {"mass": mass, "com": [0.5 * (start + stop), 0.0], "inertia": mass * (length**2 + height**2) / 12}
    return values, f"[estimate] m = {ends:g} rho_A a, a = {length:.3g}; m (a^2 + h^2) / 12"


def _joint(table: BoomTable, joint: DrawnJoint, first: float | None) -> list[Row]:
    told = {"range_deg": "lowest and highest joint angle, degrees"}
    shared = joint.model_dump(include=set(JointGeometry.model_fields), exclude_none=True)
    rows: list[Row] = [(key, value, told.get(key, "")) for key, value in shared.items()]
    rows.append(("cylinder", "", ""))
    return rows + [(f"  {key}", value, told) for key, value, told in _cylinder(table, joint, first)]


def _cylinder(table: BoomTable, joint: DrawnJoint, first: float | None) -> list[Row]:
    closed, stroke, told = _stroke(table, joint)
    rho = table.material.rho or 0.0
    values = joint.model_dump(include={"bore", "rod", "cap_line", "rod_line"})
    oil = Oil(bulk_modulus=table.bulk_modulus, **values)
    k = Cylinder(closed_length=closed, max_stroke=stroke, oil=oil).middle_stiffness
    rows: list[Row] = [
        ("oil", oil.model_dump(), ""),
        ("", "", "k(s) = B [Ac^2/(Vc + Ac s) + Ar^2/(Vr + Ar (max_stroke - s))], B bulk_modulus, Vc cap_line, Vr rod_line"),
        ("", "", f"Ac = pi bore^2/4 = {oil.cap_area:.3g}, Ar = pi (bore^2 - rod^2)/4 = {oil.rod_area:.3g}"),
        ("", "", f"k = {k:.3g} N/m in the middle of the stroke; `k` instead of `oil` keeps it the same over the stroke"),
    ]
    if first is not None:
        rows.append(("d", k * _delay(table, first), "[estimate] 2 zeta k / omega, as beta, k in the middle"))
    rows += [("closed_length", closed, told), ("max_stroke", stroke, told)]
    barrel = rho * math.pi * joint.bore**2 * TUBE * (1 + TUBE) * closed
    rod = rho * math.pi / 4 * joint.rod**2 * closed
    rows.append(("barrel", _rod(barrel, closed), f"[estimate] a tube of closed_length, wall {TUBE:g} bore"))
    rows.append(("rod", _rod(rod, closed), "[estimate] a round bar of closed_length; m L^2 / 12"))
    return rows


def _stroke(table: BoomTable, joint: DrawnJoint) -> tuple[float, float, str]:
    """Return closed length and stroke (m), and where they come from."""
    if joint.closed_length is not None and joint.max_stroke is not None:
        return joint.closed_length, joint.max_stroke, "from the table"
    least, most = _lengths(table, joint)
    spare = SPARE * (most - least)
    closed = joint.closed_length or math.floor(1e3 * (least - spare)) / 1e3
    stroke = joint.max_stroke or math.ceil(1e3 * (most + spare - closed)) / 1e3
    return closed, stroke, f"over range_deg the pins are {least:.4g} to {most:.4g} m apart; {100 * SPARE:g} % to spare"


def _lengths(table: BoomTable, joint: DrawnJoint) -> tuple[float, float]:
    """Return the least and greatest distance (m) of the pins over the range; 1 and 2 if they are incomplete or never meet."""
    first = Section(length=table.sections[0].length, rod_pin=table.sections[0].rod_pin)
    try:
        row = linkage_of(joint, table.base, first)
    except TypeError:  # a pin is not given: the checks of the scene name it
        return 1.0, 2.0
    lengths = joint_curve(row, np.radians(np.linspace(*joint.range_deg, RANGE_SAMPLES))).lengths
    lengths = lengths[np.isfinite(lengths)]
    return (float(lengths.min()), float(lengths.max())) if lengths.size else (1.0, 2.0)


def _rod(mass: float, length: float) -> dict[str, float]:
    return {"mass": mass, "inertia": mass * length**2 / 12, "com": 0.5 * length}


def _delay(table: BoomTable, first: float) -> float:
    return table.damping_ratio / (math.pi * first)


def _postures(table: BoomTable) -> list[str]:
    """Return the lines of the table's postures, else of the boom as straight as its ranges allow and amid its ranges."""
    if table.postures:
        return ["postures:", *(f"  {yaml_text(name)}: {yaml_text(angles)}" for name, angles in table.postures.items())]
    ranges = np.array([joint.range_deg for joint in table.joints])
    straight, middle = np.cumsum(np.clip(0.0, *ranges.T)).tolist(), np.cumsum(ranges.mean(axis=1)).tolist()
    told = "# section angles to the base, degrees: sums of joint angles, those next to 0 and those amid range_deg"
    return [told, "postures:", f"  stretched: {yaml_text(straight)}", f"  middle: {yaml_text(middle)}"]


def _item(rows: list[Row]) -> list[str]:
    comment_column = 46  # where comments begin
    lines = []
    for number, (key, value, told) in enumerate(rows):
        text = value if isinstance(value, str) else yaml_text(value)  # words stand without quotes
        own = f"  {'-' if number == 0 else ' '} {key}: {text}".rstrip() if key.strip() else ""
        lines.append(f"{own:{comment_column}}  # {told}" if told else own)
    return lines


# -- faults of the scene, reported at the keys and lines of the table ----------------------------------------------------

ORIGINS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (r"(sections\[\d+\])\.(A|I|rho_I)", (r"\1.wall",)),
    (r"(sections\[\d+\])\.rho_A", (r"\1.pipe", "pipe", r"\1.wall")),
    (r"(sections\[\d+\])\.(root|head)\b.*", (r"\1.beam",)),
    (r"sections\[\d+\]\.beta", ("damping_ratio",)),
    (r"joints\[\d+\]\.cylinder\.d", ("damping_ratio",)),
    (r"joints\[\d+\]\.cylinder\.oil\.bulk_modulus", ("bulk_modulus",)),
    (r"(joints\[\d+\])\.cylinder\.oil\.(\w+)", (r"\1.\2",)),
    (r"(joints\[\d+\])\.cylinder\.(closed_length|max_stroke)", (r"\1.\2", r"\1.range_deg")),
    (r"(joints\[\d+\])\.cylinder\.rod\b.*", (r"\1.rod",)),
    (r"(joints\[\d+\])\.cylinder\..*", (r"\1.bore",)),
    (r"tip\.payload", ("payload",)),
)
"""Paths of a scene, and the keys of a table that they come from, of which the first that is there is told."""


def in_table(faults: Sequence[Fault], table: Document) -> list[Fault]:
    """Return the faults with paths, values and lines of the table, in its order; one of each value that others come from."""
    told = [
        table.fault(place_of(each.path), each.value, each.bound, each.remedy, each.kind)
        for each in faults
        if not _origins(each.path)
    ]
    blocks = {place_of(each.path)[:2] for each in told}
    of_origins: dict[str, Fault] = {}
    for fault in faults:
        if (places := _origins(fault.path)) and place_of(fault.path)[:2] not in blocks:  # else it follows from what is told
            moved = _at_origin(fault, places, table)
            of_origins.setdefault(moved.path, moved)
    return sorted([*told, *of_origins.values()], key=lambda fault: fault.line or 0)


def _at_origin(fault: Fault, places: list[Place], table: Document) -> Fault:
    place = next((place for place in places if table.written(place) is not None), places[0])
    written = table.written(place)
    value = f" = {fault.value:.4g}" if isinstance(fault.value, float) else ""
    bound = f"it gives the scene {fault.path}{value}: {fault.bound}"
    return table.fault(place, ABSENT if written is None else written, bound, fault.remedy, fault.kind)


def _origins(path: str) -> list[Place]:
    for pattern, keys in ORIGINS:
        if found := re.fullmatch(pattern, path):
            return [place_of(found.expand(key)) for key in keys]
    return []


def place_of(path: str) -> Place:
    """Return the place that `boom_twin.config.yaml_text.words` writes so: ``sections[1].root.mass``."""
    return tuple(int(index) if index else key for key, index in re.findall(r"(\w+)|\[(\d+)\]", path))
