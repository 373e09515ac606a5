"""Summary of a scene's model: lengths, masses, coordinates, unknowns, and which parts are left out."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .kinematics import RANGE_SAMPLES, joint_curve, linkage, stroke_range
from .schema import IDEAL_BELOW, Joint, Pin, Scene, Section
from .segmentation import CylinderPin, flexible_parts, splits

STATIONS = (0.0, 0.25, 0.5, 0.75, 1.0)  # shares of the full stroke at which k is told


def left_out(scene: Scene) -> dict[str, str]:
    """Return what the model is without each key that is absent somewhere, by key: sections, joints, the rest."""
    found = _absent("sections", [_absent_in_section(scene, i) for i in range(len(scene.sections))])
    found |= _absent("joints", [_absent_in_joint(joint) for joint in scene.joints])
    if not scene.payload:
        found["tip.payload"] = "no mass at the tip"
    if not scene.line_fill:
        found["line_fill"] = "the pipe line is empty"
    if not scene.base.inclination:
        found["base.inclination"] = "the base stands level"
    if scene.base.stiffness is None:
        found["base.stiffness"] = "the base is rigid"
    elif not scene.base.damping:
        found["base.damping"] = "no damping in the hinge of the base"
    pins = () if scene.clearance is None else scene.clearance.pins
    if not pins:
        found["clearance"] = "ideal pins"
    if tight := ", ".join(str(i) for i, pin in enumerate(pins) if pin.radial_clearance < IDEAL_BELOW):
        found[f"clearance.pins[{tight}].radial_clearance"] = f"below {IDEAL_BELOW * 1e6:g} um, so the pin is ideal"
    return found


def _absent_in_section(scene: Scene, i: int) -> dict[str, str]:
    section = scene.sections[i]
    if section.beam is None:
        return {"beam": "rigid, all of it described by root"}
    if not scene.is_flexible(i):
        absent = {"modes": "zero, so the beam is rigid and keeps its mass"}
    else:
        absent = {} if section.beta else {"beta": "no damping of the beam"}
        absent |= {} if section.rho_I else {"rho_I": "no rotary inertia of the beam"}
        if not scene.of_section(i, "axial"):
            absent["axial"] = "false, so the beam does not stretch"
        if not scene.of_section(i, "geometric"):
            absent["geometric"] = "false, so bending is linear, without geometric stiffness"
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


def _absent(block: str, items: list[dict[str, str]]) -> dict[str, str]:
    """Return one entry per key, for all items of a list that lack it: ``sections[1, 3].beta``."""
    keys = dict.fromkeys((key, meaning) for item in items for key, meaning in item.items())
    found = {}
    for key, meaning in keys:
        where = [str(i) for i, item in enumerate(items) if item.get(key) == meaning]
        index = "*" if len(where) == len(items) > 1 else ", ".join(where)
        found[f"{block}[{index}].{key}"] = meaning
    return found


UNKNOWNS_A, UNKNOWNS_B, UNKNOWNS_PIN, UNKNOWNS_BASE = 2, 6, 2, 1
"""Unknowns of joint A (angle of the section, cylinder force), of a six-bar (angles of section and two links, two components of
the pin force, cylinder force), of a pin with clearance (offset of its journal), and of an elastic base (its turn)."""


@dataclass(frozen=True, slots=True)
class SectionAccount:
    """Section `number` (from 1) in the model."""

    number: int
    section: Section
    parts: tuple[tuple[float, float], ...]  # ends of its flexible parts, m
    splits: tuple[CylinderPin, ...]
    bending: int  # coordinates of each part
    axial: int
    fill_mass: float  # kg

    @property
    def mass(self) -> float:
        """All of the section with its line fill, kg."""
        return self.section.mass + self.fill_mass

    @property
    def unknowns(self) -> int:
        """Coordinates of all parts together."""
        return len(self.parts) * (self.bending + self.axial)


@dataclass(frozen=True, slots=True)
class JointAccount:
    """Joint `number` (from 1) with its links and its cylinder.

    ``stroke_low``, ``stroke_high`` (m) are reached over ``range_deg`` where links close and the cylinder reaches. ``lever`` is
    the least and the greatest ds/dphi (m) over it, ``transmission_deg`` the least angle between the links, None for kind A.
    ``k_over_stroke`` (N/m) is at `STATIONS` for a cylinder with oil, else empty.
    """

    number: int
    joint: Joint
    stroke_low: float
    stroke_high: float
    k_over_stroke: tuple[float, ...]
    lever: tuple[float, float]
    transmission_deg: float | None

    @property
    def unknowns(self) -> int:
        """Unknowns of a joint of its kind."""
        return UNKNOWNS_A if self.joint.kind == "A" else UNKNOWNS_B


@dataclass(frozen=True, slots=True)
class Account:
    """Model that a scene describes; ``pins`` are those with clearance."""

    scene: Scene
    sections: tuple[SectionAccount, ...]
    joints: tuple[JointAccount, ...]
    pins: tuple[Pin, ...]
    left_out: dict[str, str]  # see `left_out`

    @property
    def mass(self) -> float:
        """Whole boom with its cylinders, line fill and payload, kg."""
        return mass_of(self.scene)

    @property
    def unknowns(self) -> int:
        """Unknowns of one step."""
        own = sum(s.unknowns for s in self.sections) + sum(j.unknowns for j in self.joints)
        return own + UNKNOWNS_PIN * len(self.pins) + UNKNOWNS_BASE * (self.scene.base.stiffness is not None)


def mass_of(scene: Scene) -> float:
    """Return the mass of a boom with its load, kg."""
    sections = sum(section.mass + _fill_mass(scene, section) for section in scene.sections)
    return sections + sum(joint.mass for joint in scene.joints) + scene.payload


def weight_of(scene: Scene) -> float:
    """Return the weight of a boom with its load, N."""
    return mass_of(scene) * math.hypot(*scene.gravity)


def explain(scene: Scene) -> Account:
    """Return the bookkeeping of the model that a scene describes."""
    numbers = range(len(scene.sections))
    pins = (pin for i in numbers for owner in ("cylinder", "joint") for pin in scene.pins_of(f"{owner}_{i + 1}"))
    return Account(
        scene,
        tuple(_section(scene, i) for i in numbers),
        tuple(_joint(scene, i) for i in numbers),
        tuple(pins),
        left_out(scene),
    )


def _fill_mass(scene: Scene, section: Section) -> float:
    return (scene.line_fill or 0.0) * section.length


def _section(scene: Scene, i: int) -> SectionAccount:
    section, parts = scene.sections[i], flexible_parts(scene, i)
    bending, axial = scene.of_section(i, "modes") if parts else 0, scene.of_section(i, "axial") if parts else 0
    return SectionAccount(i + 1, section, parts, splits(scene, i), bending, axial, _fill_mass(scene, section))


def _joint(scene: Scene, i: int) -> JointAccount:
    joint, cylinder = scene.joints[i], scene.joints[i].cylinder
    low, high = stroke_range(scene, i, RANGE_SAMPLES)
    oil = () if cylinder.oil is None else tuple(cylinder.stiffness(share * cylinder.max_stroke) for share in STATIONS)
    _, levers, between = joint_curve(linkage(scene, i), np.radians(np.linspace(*joint.range_deg, RANGE_SAMPLES)))
    lever = float(np.nanmin(levers)), float(np.nanmax(levers))
    return JointAccount(i + 1, joint, low, high, oil, lever, float(np.nanmin(between)) if i else None)
