"""Summary of a scene's model: lengths, masses, coordinates, unknowns, and which parts are left out."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .checks.linkages import LinkageAccount, linkage_account
from .kinematics import RANGE_SAMPLES, stroke_range
from .oil_spring import stiffness_over_stroke
from .schema import IDEAL_BELOW, Base, Joint, Pin, Scene
from .segmentation import Split, flexible_parts, splits


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A key that the scene does not name, and what the model therefore is."""

    key: str
    meaning: str


def left_out(scene: Scene) -> tuple[LeftOut, ...]:
    """Return one entry per key that is absent somewhere, in the order sections, joints, the rest."""
    found = _absent("sections", [_absent_in_section(scene, i) for i in range(len(scene.sections))])
    found += _absent("joints", [_absent_in_joint(joint) for joint in scene.joints])
    if not scene.payload:
        found.append(LeftOut("tip.payload", "no mass at the tip"))
    if not scene.line_fill:
        found.append(LeftOut("line_fill", "the pipe line is empty"))
    if not scene.base.inclination:
        found.append(LeftOut("base.inclination", "the base stands level"))
    if scene.base.stiffness is None:
        found.append(LeftOut("base.stiffness", "the base is rigid"))
    elif not scene.base.damping:
        found.append(LeftOut("base.damping", "no damping in the hinge of the base"))
    if scene.clearance is None or not scene.clearance.pins:
        return (*found, LeftOut("clearance", "ideal pins"))
    tight = [i for i, pin in enumerate(scene.clearance.pins) if pin.radial_clearance < IDEAL_BELOW]
    if tight:
        where = ", ".join(map(str, tight))
        meaning = f"below {IDEAL_BELOW * 1e6:g} um, so the pin is ideal"
        found.append(LeftOut(f"clearance.pins[{where}].radial_clearance", meaning))
    return tuple(found)


def _absent_in_section(scene: Scene, i: int) -> dict[str, str]:
    section = scene.sections[i]
    if section.beam is None:
        return {"beam": "rigid, all of it described by root"}
    if not scene.is_flexible(i):
        absent = {"modes": "zero, so the beam is rigid and keeps its mass"}
    else:
        absent = {} if section.beta else {"beta": "no damping of the beam"}
        absent |= {} if section.rho_I else {"rho_I": "no rotary inertia of the beam"}
        absent |= {} if scene.has_axial(i) else {"axial": "false, so the beam does not stretch"}
        absent |= {} if scene.has_geometric(i) else {"geometric": "false, so bending is linear, without geometric stiffness"}
    for key, end in (("root", "inboard"), ("head", "outboard")):
        if getattr(section, key) is None:
            absent[key] = f"the rigid {end} part has no mass"
    return absent


def _absent_in_joint(joint: Joint) -> dict[str, str]:
    cylinder = joint.cylinder
    absent = {}
    if joint.kind != "A":
        absent = {key: "massless link" for key in ("mL", "mR") if not getattr(joint, key)}
    if not cylinder.is_compressible:
        absent["cylinder.k"] = "incompressible: the stroke drives the joint"
    elif not cylinder.d:
        absent["cylinder.d"] = "no damping in the oil spring"
    for key in ("barrel", "rod"):
        if getattr(cylinder, key) is None:
            absent[f"cylinder.{key}"] = f"massless {key}"
    return absent


def _absent(block: str, items: list[dict[str, str]]) -> list[LeftOut]:
    """Return one entry per key, for all items of a list that lack it: ``sections[1, 3].beta``."""
    keys = dict.fromkeys((key, meaning) for item in items for key, meaning in item.items())
    found = []
    for key, meaning in keys:
        where = [str(i) for i, item in enumerate(items) if item.get(key) == meaning]
        index = "*" if len(where) == len(items) > 1 else ", ".join(where)
        found.append(LeftOut(f"{block}[{index}].{key}", meaning))
    return found


UNKNOWNS_A, UNKNOWNS_B, UNKNOWNS_PIN, UNKNOWNS_BASE = 2, 6, 2, 1


@dataclass(frozen=True, slots=True)
class SectionAccount:
    """Section `number` (from 1). Lengths in m, masses in kg.

    ``parts`` are the ends of its flexible parts, ``bending`` and ``axial`` the bending and axial coordinates of each,
    ``unknowns`` those of all its parts together. ``beam_mass`` counts without the line fill.
    """

    number: int
    length: float
    has_beam: bool
    parts: tuple[tuple[float, float], ...]
    splits: tuple[Split, ...]
    bending: int
    axial: int
    beam_mass: float
    root_mass: float
    head_mass: float
    fill_mass: float
    unknowns: int

    @property
    def mass(self) -> float:
        """All of the section, kg."""
        return self.beam_mass + self.root_mass + self.head_mass + self.fill_mass


@dataclass(frozen=True, slots=True)
class JointAccount:
    """Joint `number` (from 1) with its links and its cylinder. Masses in kg, strokes in m, angles in degrees.

    ``stroke_low``, ``stroke_high`` are reached over ``range_deg`` where links close and the cylinder reaches. The joint
    of kind A has two unknowns (angle of the section, cylinder force), a six-bar six (angles of section and two links,
    two components of the pin force, cylinder force). ``k_over_stroke`` (N/m) is at
    `boom_twin.scene.oil_spring.STATIONS` for a cylinder with oil, else empty. ``side`` is empty for kind A.
    """

    number: int
    kind: str
    range_deg: tuple[float, float]
    stroke_low: float
    stroke_high: float
    max_stroke: float
    k: float | None
    k_over_stroke: tuple[float, ...]
    d: float | None
    side: str
    linkage: LinkageAccount
    link_mass: float
    barrel_mass: float
    rod_mass: float
    unknowns: int

    @property
    def mass(self) -> float:
        """Links, barrel and rod, kg."""
        return self.link_mass + self.barrel_mass + self.rod_mass


@dataclass(frozen=True, slots=True)
class Account:
    """Everything about a scene's model. ``length`` is the sum of all sections (m), ``payload`` in kg.

    ``pins`` are those with clearance; each has two unknowns, the offset of its journal. An elastic ``base`` has one
    unknown, its turn.
    """

    sections: tuple[SectionAccount, ...]
    joints: tuple[JointAccount, ...]
    pins: tuple[Pin, ...]
    payload: float
    base: Base
    left_out: tuple[LeftOut, ...]

    @property
    def length(self) -> float:
        """Straight boom, pivot of section 1 to the tip, m."""
        return sum(section.length for section in self.sections)

    @property
    def mass(self) -> float:
        """Whole boom with its cylinders, line fill and payload, kg."""
        return sum(s.mass for s in self.sections) + sum(j.mass for j in self.joints) + self.payload

    @property
    def unknowns(self) -> int:
        """Unknowns of one step."""
        own = sum(s.unknowns for s in self.sections) + sum(j.unknowns for j in self.joints)
        return own + UNKNOWNS_PIN * len(self.pins) + UNKNOWNS_BASE * (self.base.stiffness is not None)


def weight_of(scene: Scene) -> float:
    """Return the weight of a boom with its load, N."""
    sections = sum(_section(scene, i).mass for i in range(len(scene.sections)))
    return (sections + sum(joint.mass for joint in scene.joints) + scene.payload) * math.hypot(*scene.gravity)


def explain(scene: Scene) -> Account:
    """Return the bookkeeping of the model that a scene describes."""
    numbers = range(len(scene.sections))
    return Account(
        sections=tuple(_section(scene, i) for i in numbers),
        joints=tuple(_joint(scene, i) for i in numbers),
        pins=tuple(pin for i in numbers for owner in ("cylinder", "joint") for pin in scene.pins_of(f"{owner}_{i + 1}")),
        payload=scene.payload,
        base=scene.base,
        left_out=left_out(scene),
    )


def _section(scene: Scene, i: int) -> SectionAccount:
    section = scene.sections[i]
    parts = flexible_parts(scene, i)
    bending = scene.modes_of(i) if parts else 0
    axial = int(bool(parts) and scene.has_axial(i))
    beam = section.beam or (0.0, 0.0)
    return SectionAccount(
        number=i + 1,
        length=section.length,
        has_beam=section.beam is not None,
        parts=parts,
        splits=splits(scene, i),
        bending=bending,
        axial=axial,
        beam_mass=(section.rho_A or 0.0) * (beam[1] - beam[0]),
        root_mass=section.root.mass if section.root is not None else 0.0,
        head_mass=section.head.mass if section.head is not None else 0.0,
        fill_mass=(scene.line_fill or 0.0) * section.length,
        unknowns=len(parts) * (bending + axial),
    )


def _joint(scene: Scene, i: int) -> JointAccount:
    joint = scene.joints[i]
    cylinder = joint.cylinder
    low, high = stroke_range(scene, i, RANGE_SAMPLES)
    return JointAccount(
        number=i + 1,
        kind=joint.kind,
        range_deg=joint.range_deg,
        stroke_low=low,
        stroke_high=high,
        max_stroke=cylinder.max_stroke,
        k=cylinder.k,
        k_over_stroke=() if cylinder.oil is None else stiffness_over_stroke(cylinder),
        d=cylinder.d,
        side="" if joint.kind == "A" else joint.side or "left",
        linkage=linkage_account(scene, i),
        link_mass=(joint.mL or 0.0) + (joint.mR or 0.0),
        barrel_mass=cylinder.barrel.mass if cylinder.barrel is not None else 0.0,
        rod_mass=cylinder.rod.mass if cylinder.rod is not None else 0.0,
        unknowns=UNKNOWNS_A if joint.kind == "A" else UNKNOWNS_B,
    )
