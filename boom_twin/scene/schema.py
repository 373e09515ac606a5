"""The scene schema: every part of a boom as a validated pydantic model, with meaning, unit and bounds of each value.

Frames, signs and points are told in the comments of the default scene (``boom_twin scene``). Error messages quote the
descriptions. A number with another unit is converted to the one stated there. ``None``: not named, so not in the model.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..kernels.elements.cylinder import oil_compliance
from ..kernels.elements.pin_contact import LAWS, restitution_of
from ..system.result_text import SummaryDisplay, numbers

LARGEST_VALUE = 1e30  # of any value, in its unit; products of larger ones leave the range of numbers
Finite = Annotated[float, Field(ge=-LARGEST_VALUE, le=LARGEST_VALUE, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST_VALUE, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST_VALUE, allow_inf_nan=False)]
Point = tuple[Finite, Finite]
Inclination = Annotated[float, Field(ge=-1.571, le=1.571)]  # a base leans by less than a quarter turn
Modes = Annotated[int, Field(ge=0, le=10)]
Mass = Annotated[NotNegative, Field(description="the mass in kg")]
Inertia = Annotated[NotNegative, Field(description="the inertia about the centre of mass in kg m^2")]

_LAWS = tuple(LAWS)
IDEAL_BELOW = 1e-6  # m; a pin with less radial clearance is taken for ideal
DEPTH_BY_GYRATION = 2.4  # depth of a drawn section over its radius of gyration: about that of a thin-walled box
MODES = "the number of bending coordinates per flexible part: a whole number from 0 to 10"
AXIAL = "true or false, whether flexible parts stretch"
GEOMETRIC = "true or false, whether flexible parts have geometric stiffness"


class Part(BaseModel):
    """Base of all parts: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)


class Material(Part):
    """Material of a boom or of a bush."""

    name: str = Field(default="steel", description="text")
    E: Positive = Field(description="Young's modulus in Pa, 2.06e11 for steel")
    nu: float = Field(default=0.3, gt=-1, le=0.5, description="Poisson's ratio, above -1 and at most 0.5")
    rho: Positive | None = Field(default=None, description="the density in kg/m^3")


class Base(Part):
    """Base of the boom; an inclination turns it anticlockwise, a stiffness lets it turn about the pivot under load."""

    pivot: Point = Field(description="[x, y] of the pin of section 1, m")
    cylinder_pin: Point = Field(description="[x, y] of the barrel pin of cylinder 1, m")
    inclination: Inclination = Field(default=0.0, description="the turn of the base in rad, or with its unit, like 5 deg")
    stiffness: Positive | None = Field(default=None, description="the stiffness of the hinge on the ground, N m/rad")
    damping: NotNegative | None = Field(default=None, description="the damping of that hinge, N m s/rad")


class RigidPart(Part):
    """Rigid end of a section, or the whole of a rigid section."""

    mass: Mass
    com: Point = Field(description="[x, y] of the centre of mass in the axes of the section, m")
    inertia: Inertia


class Section(Part):
    """One boom section, pivot to pivot.

    ``height`` is no part of the model, but stresses and checks need it. ``modes``, ``axial`` and ``geometric`` take the boom's
    where the section does not name them.
    """

    length: Positive = Field(description="the length from pivot to pivot, m")
    beam: tuple[Finite, Finite] | None = Field(
        default=None, description="[x0, x1] of the flexible part, m from the inboard pivot"
    )
    A: Positive | None = Field(default=None, description="the area of the cross-section, m^2")
    I: Positive | None = Field(default=None, description="the second moment of area, m^4")  # noqa: E741 - the contract's key
    rho_A: Positive | None = Field(default=None, description="the mass per metre, kg/m")
    rho_I: NotNegative | None = Field(default=None, description="the rotary inertia per metre, kg m")
    beta: NotNegative | None = Field(default=None, description="the stiffness-proportional damping, s")
    height: Positive | None = Field(default=None, description="the outer height of the box, m")
    modes: Modes | None = Field(default=None, description=MODES)
    axial: bool | None = Field(default=None, description=AXIAL)
    geometric: bool | None = Field(default=None, description=GEOMETRIC)
    root: RigidPart | None = Field(default=None, description="a block with mass, com, inertia of the rigid inboard part")
    head: RigidPart | None = Field(default=None, description="a block with mass, com, inertia of the rigid outboard part")
    rod_pin: Point | None = Field(default=None, description="[x, y] of the rod pin of cylinder 1, m")

    @property
    def beam_mass(self) -> float:
        """Mass of the beam without concrete, kg; 0 without a beam."""
        return 0.0 if self.beam is None else (self.rho_A or 0.0) * (self.beam[1] - self.beam[0])

    @property
    def mass(self) -> float:
        """Mass of beam, root and head, kg."""
        return sum((part.mass for part in (self.root, self.head) if part is not None), start=self.beam_mass)

    @property
    def depth(self) -> float:
        """Depth (m) to draw the section with: its height, else that of a box with its A and I."""
        depth_by_length = 0.05  # of its length, where a section has no A and I
        if self.height is not None:
            return self.height
        if self.A is None or self.I is None:
            return depth_by_length * self.length
        return DEPTH_BY_GYRATION * math.sqrt(self.I / self.A)

    @property
    def section_modulus(self) -> float | None:
        """Section modulus 2 I / height, m^3: bending moment over stress in the flanges; None without I or height."""
        return None if self.I is None or self.height is None else 2.0 * self.I / self.height


class CylinderPart(Part):
    """Barrel or rod of a cylinder."""

    mass: Mass
    inertia: Inertia
    com: NotNegative = Field(description="the distance of the centre of mass from the part's pin, m")


Bore = Annotated[float, Field(ge=1e-3, le=1.0, allow_inf_nan=False, description="the diameter of the piston, m")]
"""Diameter of a piston. One of more than 1 m is in no boom: it was given in mm."""
Rod = Annotated[Positive, Field(description="the diameter of the rod, m")]
OIL_MODULUS = "the bulk modulus of the oil in Pa, 1.4e9 to 1.7e9; less with air in it"
BulkModulus = Annotated[float, Field(ge=1e7, le=1e11, description=OIL_MODULUS)]
CAP_LINE = "the oil between piston and valve on the cap side at stroke 0, m^3"
ROD_LINE = "the oil between piston and valve on the rod side at max_stroke, m^3"


class Oil(Part):
    """Oil shut in both chambers of a cylinder."""

    bore: Bore
    rod: Rod
    bulk_modulus: BulkModulus
    cap_line: NotNegative = Field(description=CAP_LINE)
    rod_line: NotNegative = Field(description=ROD_LINE)

    @property
    def cap_area(self) -> float:
        """Area of the piston, m^2."""
        return 0.25 * math.pi * self.bore**2

    @property
    def rod_area(self) -> float:
        """Area of the piston on the side of the rod, m^2."""
        return 0.25 * math.pi * (self.bore - self.rod) * (self.bore + self.rod)


class Cylinder(Part):
    """Drive with oil spring and damper.

    The spring is a number `k`, or follows from `oil` over the stroke; neither means incompressible.
    """

    k: Positive | None = Field(default=None, description="the stiffness of the oil spring, N/m")
    oil: Oil | None = Field(default=None, description="a block with bore, rod, bulk_modulus, cap_line, rod_line, instead of k")
    d: NotNegative | None = Field(default=None, description="the viscous damping, N s/m")
    closed_length: Positive = Field(description="the length from pin to pin at stroke 0, m")
    max_stroke: Positive = Field(description="the largest stroke, m")
    barrel: CylinderPart | None = Field(default=None, description="a block with mass, inertia, com")
    rod: CylinderPart | None = Field(default=None, description="a block with mass, inertia, com")

    @property
    def is_compressible(self) -> bool:
        """Return True if the cylinder has an oil spring."""
        return self.k is not None or self.oil is not None

    @property
    def oil_row(self) -> dict[str, float]:
        """Fields of `boom_twin.kernels.elements.cylinder.OIL` for a cylinder with `oil`."""
        values = ("bulk_modulus", "cap_area", "rod_area", "cap_line", "rod_line")
        return {key: getattr(self.oil, key) for key in values} | {"max_stroke": self.max_stroke, "damping": self.d or 0.0}

    def stiffness(self, stroke: float) -> float:
        """Return k (N/m) at a stroke of the drive (m): the given number, that of the oil, or infinity.

        k(s) = B (A_c^2 / (V_c + A_c s) + A_r^2 / (V_r + A_r (s_max - s))): bulk modulus B, areas A and oil V at stroke 0 or
        s_max of cap side and rod side.
        """
        if self.oil is None:
            return math.inf if self.k is None else self.k
        compliance = float(oil_compliance(SimpleNamespace(**self.oil_row), stroke))
        return 1.0 / compliance if compliance else math.inf

    @property
    def middle_stiffness(self) -> float:
        """k in the middle of the stroke, N/m."""
        return self.stiffness(0.5 * self.max_stroke)


BEFORE = "the outboard pivot of the section before"


class JointGeometry(Part):
    """Pins, links and range of a joint that turns one section: kind A (slider-crank), B1, B2 or B3 (six-bar).

    ``side`` of D->E is seen from D to E; not named: left.
    """

    kind: Literal["A", "B1", "B2", "B3"] = Field(description="A, B1, B2 or B3")
    range_deg: tuple[Finite, Finite] = Field(description="[low, high] of the relative joint angle, degrees")
    C: Point | None = Field(default=None, description=f"[x, y] of the barrel pin from {BEFORE}, m")
    D: Point | None = Field(default=None, description=f"[x, y] of the pivot of link L from {BEFORE}, m")
    E: Point | None = Field(default=None, description="[x, y] of the pin of link R from the pivot of its own section, m")
    side: Literal["left", "right"] | None = Field(default=None, description="left or right of D->E, where the links meet")
    lL: Positive | None = Field(default=None, description="the length of link L, m")
    lR: Positive | None = Field(default=None, description="the length of link R, m")
    R: Point | None = Field(default=None, description="[along, left], the place of the rod pin on its link, m")
    mL: NotNegative | None = Field(default=None, description="the mass of link L, kg")
    mR: NotNegative | None = Field(default=None, description="the mass of link R, kg")


class Joint(JointGeometry):
    """Joint with its cylinder."""

    cylinder: Cylinder = Field(description="a block with closed_length and max_stroke")

    @property
    def mass(self) -> float:
        """Mass of links, barrel and rod, kg."""
        parts = (self.cylinder.barrel, self.cylinder.rod)
        return sum((part.mass for part in parts if part is not None), start=(self.mL or 0.0) + (self.mR or 0.0))


class ContactLaw(Part):
    """Contact of journal and bush."""

    law: Literal[_LAWS] = Field(  # type: ignore[valid-type]
        default="lankarani-nikravesh", description=f"{', '.join(_LAWS[:-1])} or {_LAWS[-1]}"
    )
    exponent: float = Field(default=1.5, ge=1.3, le=3, description="the exponent of the penetration, 1.3 to 3; 1.5 for Hertz's")
    restitution: float = Field(default=0.9, gt=0, le=1, description="the coefficient of restitution, above 0 and at most 1")
    friction: float = Field(default=0.0, ge=0, le=2, description="Coulomb's coefficient of friction, 0 to 2")
    bush: Material | None = Field(default=None, description="a block with E (Pa) and nu of the bush, if it is another material")

    @property
    def given_restitution(self) -> float:
        """Restitution that impacts by this law really have."""
        return restitution_of(LAWS[self.law](self.restitution))


class Pin(Part):
    """A pin with play."""

    at: str = Field(
        description="which pin: cylinder_i.rod, cylinder_i.barrel, joint_i.pivot, joint_i.link_L, joint_i.link_R or joint_i.Q"
    )
    pin_radius: Positive = Field(description="the radius of the pin, m")
    radial_clearance: NotNegative = Field(description="the radius of the hole less that of the pin, m")


class Clearance(Part):
    """Pins that are not ideal: real contact, or springs and dampers linearised at their preload."""

    treatment: Literal["contact", "spring-damper"] = Field(default="contact", description="contact or spring-damper")
    contact: ContactLaw = Field(default=ContactLaw(), description="a block with law, exponent, restitution, friction")
    pins: tuple[Pin, ...] = Field(default=(), description="a list with one block per pin")


class Tip(Part):
    """Payload of the boom."""

    payload: NotNegative | None = Field(default=None, description="the point mass at the tip of the last section, kg")


class Scene(SummaryDisplay, Part):
    """A whole boom with its base, its gravity and its named postures (angles to the base's x axis).

    ``geometric`` parts turn finitely, which gives them the stiffness of axial loads; else bending is linear.
    """

    description: str = Field(default="", description="text")
    gravity: Point = Field(description="[x, y] in m/s^2, for example [0.0, -9.81]")
    material: Material = Field(description="a block with E (Pa)")
    base: Base = Field(description="a block with pivot and cylinder_pin")
    modes: Modes = Field(default=3, description=MODES)
    axial: bool = Field(default=True, description=AXIAL)
    geometric: bool = Field(default=True, description=GEOMETRIC)
    sections: tuple[Section, ...] = Field(min_length=1, description="a list with one block per section")
    joints: tuple[Joint, ...] = Field(min_length=1, description="a list with one block per joint")
    tip: Tip | None = Field(default=None, description="a block with payload (kg)")
    line_fill: NotNegative | None = Field(default=None, description="the concrete in the pipe line, kg/m")
    clearance: Clearance | None = Field(default=None, description="a block with pins, contact and treatment")
    postures: dict[str, tuple[Finite, ...]] = Field(default={}, description="a block of names with section angles in degrees")

    def with_(self, changes: Mapping[str, Any] | None = None, /, **named: Any) -> Scene:
        """Return the scene with other values, checked as a scene file is: ``scene.with_(payload=40)``.

        Parameters
        ----------
        changes : mapping, optional
            Parameters by name, as ``{"cylinder_2.k": 2e7}``: ``cylinder_i.k``, ``cylinder_i.d``, ``section_i.EI``,
            ``section_i.beta``, ``section_i.mass``, SI.
        **named
            ``payload`` (kg), or keys at the top of a scene file: ``line_fill``, ``modes``, ``gravity``, ..; None takes one out.

        Raises
        ------
        UsageError, SceneError
            There is no such key or parameter; the scene cannot have such values: all faults.
        """
        from .edit import changed

        return changed(self, {**(changes or {}), **named})

    def summary_rows(self) -> dict[str, str]:
        """See `boom_twin.system.result_text.SummaryDisplay`."""
        return {
            "sections": f"{len(self.sections)}, {numbers([section.length for section in self.sections])} m",
            "joints": " + ".join(joint.kind for joint in self.joints),
            "reach": f"{self.reach:.4g} m",
            "payload": f"{self.payload:g} kg",
            "postures": ", ".join(self.postures) or "none",
        }

    @property
    def payload(self) -> float:
        """Point mass at the tip, kg; 0 if the scene has none."""
        return 0.0 if self.tip is None else self.tip.payload or 0.0

    @property
    def reach(self) -> float:
        """Length of the straight boom, pivot of section 1 to the tip, m."""
        return sum(section.length for section in self.sections)

    def pins_of(self, owner: str) -> tuple[Pin, ...]:
        """Return the pins with clearance of ``cylinder_i`` or ``joint_i``, in the order in which the scene lists them."""
        pins = () if self.clearance is None else self.clearance.pins
        return tuple(pin for pin in pins if pin.at.split(".")[0] == owner and pin.radial_clearance >= IDEAL_BELOW)

    def of_section(self, index: int, key: Literal["modes", "axial", "geometric"]) -> int:
        """Return ``modes``, ``axial`` or ``geometric`` of section `index` (0-based): its own value, else the boom's."""
        own = getattr(self.sections[index], key)
        return int(getattr(self, key) if own is None else own)

    def is_flexible(self, index: int) -> bool:
        """Return True if section `index` (0-based) bends."""
        return self.sections[index].beam is not None and self.of_section(index, "modes") > 0
