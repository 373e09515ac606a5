"""The scene schema: every part of a boom as a validated pydantic model, with the unit and the bounds of each value.

Frames, signs and the meaning of every point are told in the comments of the default scene (``boom_twin scene``).
All values are SI. ``None`` means "not named, therefore not in the model".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from ..kernels.elements.pin_contact import LAWS, restitution_of
from ..system.summary_display import SummaryDisplay, numbers

LARGEST = 1e30  # of any value, in its unit; products of larger ones leave the range of numbers
Finite = Annotated[float, Field(ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST, allow_inf_nan=False)]
Point = tuple[Finite, Finite]
Modes = Annotated[int, Field(ge=0, le=10)]

if TYPE_CHECKING:
    LawName = str
else:
    LawName = Literal[tuple(LAWS)]  # pydantic refuses any other, and names them

IDEAL_BELOW = 1e-6  # m; a pin with less radial clearance is taken for ideal


class Part(BaseModel):
    """Base of all parts: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Material(Part):
    """E (Pa), Poisson's ratio, density (kg/m^3)."""

    name: str = "steel"
    E: Positive
    nu: Annotated[float, Field(gt=-1, le=0.5)] = 0.3
    rho: Positive | None = None


class Base(Part):
    """Pivot of section 1, barrel pin of cylinder 1 (m); inclination (rad) turns the base anticlockwise."""

    pivot: Point
    cylinder_pin: Point
    inclination: Finite = 0.0


class RigidPart(Part):
    """Mass (kg), centre in the axes of its section (m), inertia about that centre (kg m^2)."""

    mass: NotNegative
    com: Point
    inertia: NotNegative


class Section(Part):
    """One boom section, pivot to pivot; lengths in m from the inboard pivot.

    ``beam`` = (x0, x1) bounds the flexible part; A (m^2), I (m^4), rho_A (kg/m), rho_I (kg m), beta (s). ``height`` is the
    outer height of the box: no part of the model, but stresses and checks need it. ``modes``, ``axial`` and ``geometric`` take
    the boom's where the section does not name them.
    """

    length: Positive
    beam: tuple[Finite, Finite] | None = None
    A: Positive | None = None
    I: Positive | None = None  # noqa: E741 - the field's symbol, and the contract's key
    rho_A: Positive | None = None
    rho_I: NotNegative | None = None
    beta: NotNegative | None = None
    height: Positive | None = None
    modes: Modes | None = None
    axial: bool | None = None
    geometric: bool | None = None
    root: RigidPart | None = None
    head: RigidPart | None = None
    rod_pin: Point | None = None

    @property
    def section_modulus(self) -> float | None:
        """Section modulus 2 I / height, m^3: bending moment over stress in the flanges; None without I or height."""
        return None if self.I is None or self.height is None else 2.0 * self.I / self.height


class CylinderPart(Part):
    """Barrel or rod: mass (kg), inertia about its own centre (kg m^2), distance of that centre from its pin (m)."""

    mass: NotNegative
    inertia: NotNegative
    com: NotNegative


Bore = Annotated[float, Field(ge=1e-3, le=1.0, allow_inf_nan=False)]
BulkModulus = Annotated[float, Field(ge=1e7, le=1e11)]
"""Diameter of a piston, m. One of more than 1 m is in no boom: it was given in mm."""


class Oil(Part):
    """Oil shut in both chambers: diameters of piston and rod (m), bulk modulus (Pa), oil in the lines of each side (m^3)."""

    bore: Bore
    rod: Positive
    bulk_modulus: BulkModulus
    cap_line: NotNegative
    rod_line: NotNegative

    @property
    def cap_area(self) -> float:
        """Area of the piston, m^2."""
        return 0.25 * math.pi * self.bore**2

    @property
    def rod_area(self) -> float:
        """Area of the piston on the side of the rod, m^2."""
        return 0.25 * math.pi * (self.bore - self.rod) * (self.bore + self.rod)


class Cylinder(Part):
    """Drive with oil spring and damper d (N s/m); lengths in m.

    The spring is a number k (N/m), or follows from `oil` over the stroke; neither means incompressible.
    """

    k: Positive | None = None
    oil: Oil | None = None
    d: NotNegative | None = None
    closed_length: Positive
    max_stroke: Positive
    barrel: CylinderPart | None = None
    rod: CylinderPart | None = None

    @property
    def is_compressible(self) -> bool:
        """Return True if the cylinder has an oil spring."""
        return self.k is not None or self.oil is not None


class Joint(Part):
    """Joint that turns one section: kind A (slider-crank), B1, B2 or B3 (six-bar).

    C, D relative to the outboard pivot of the section before, E to the pivot of its own section (m); link lengths
    lL, lR (m) and masses mL, mR (kg); R places the rod pin on a link (B2, B3). ``range_deg`` is in degrees. ``side`` of D->E on
    which the links meet, seen from D to E; not named: left.
    """

    kind: Literal["A", "B1", "B2", "B3"]
    range_deg: tuple[Finite, Finite]
    C: Point | None = None
    D: Point | None = None
    E: Point | None = None
    side: Literal["left", "right"] | None = None
    lL: Positive | None = None
    lR: Positive | None = None
    R: Point | None = None
    mL: NotNegative | None = None
    mR: NotNegative | None = None
    cylinder: Cylinder

    @property
    def side_sign(self) -> float:
        """Side of D->E on which the links meet: 1 left, -1 right."""
        return -1.0 if self.side == "right" else 1.0


class ContactLaw(Part):
    """Contact of journal and bush: law, exponent, restitution, Coulomb friction; a bush of another material (E in Pa)."""

    law: LawName = "lankarani-nikravesh"
    exponent: Annotated[float, Field(ge=1.3, le=3)] = 1.5
    restitution: Annotated[float, Field(gt=0, le=1)] = 0.9
    friction: Annotated[float, Field(ge=0, le=2)] = 0.0
    bush: Material | None = None

    @property
    def given_restitution(self) -> float:
        """Restitution that impacts by this law really have."""
        return restitution_of(LAWS[self.law](self.restitution))


class Pin(Part):
    """A pin with play: ``at`` names it, as in ``cylinder_1.rod``; radius of the journal and radial clearance, m."""

    at: str
    pin_radius: Positive
    radial_clearance: NotNegative


class Clearance(Part):
    """Pins that are not ideal, and whether they are real contact or springs and dampers linearised at their preload."""

    treatment: Literal["contact", "spring-damper"] = "contact"
    contact: ContactLaw = ContactLaw()
    pins: tuple[Pin, ...] = ()


class Tip(Part):
    """Payload: a point mass at the outboard pivot of the last section (kg)."""

    payload: NotNegative | None = None


class Scene(SummaryDisplay, Part):
    """A whole boom with its base, its gravity (m/s^2) and its named postures (deg to the base's x axis).

    ``modes``: bending coordinates per flexible part. ``axial``: whether flexible parts stretch. ``geometric``: whether they
    turn finitely, which gives them the stiffness of axial loads; else bending is linear.
    """

    description: str = ""
    gravity: Point
    material: Material
    base: Base
    modes: Modes = 3
    axial: bool = True
    geometric: bool = True
    sections: Annotated[tuple[Section, ...], Field(min_length=1)]
    joints: Annotated[tuple[Joint, ...], Field(min_length=1)]
    tip: Tip | None = None
    line_fill: NotNegative | None = None
    clearance: Clearance | None = None
    postures: dict[str, tuple[Finite, ...]] = {}

    def with_(self, changes: Mapping[str, Any] | None = None, /, **named: Any) -> Scene:
        """The scene with other values, checked as a scene file is: ``scene.with_(payload=40)``.

        Parameters
        ----------
        changes : mapping, optional
            Parameters by name, as ``{"cylinder_2.k": 2e7}``: ``cylinder_i.k``, ``cylinder_i.d``, ``section_i.EI``,
            ``section_i.beta``, ``section_i.mass``, SI.
        **named
            ``payload`` (kg), or keys at the top of a scene file: ``line_fill``, ``modes``, ``gravity``, ..; None takes one out.

        Returns
        -------
        Scene
            A new one; this one stays as it is.

        Raises
        ------
        UsageError
            There is no such key or parameter.
        SceneError
            The scene cannot have such values: all faults.
        """
        from .edit import changed

        return changed(self, {**(changes or {}), **named})

    def summary_rows(self) -> dict[str, str]:
        """See `boom_twin.system.summary_display.SummaryDisplay`."""
        return {
            "sections": f"{len(self.sections)}, {numbers([section.length for section in self.sections])} m",
            "joints": " + ".join(joint.kind for joint in self.joints),
            "reach": f"{self.reach:.4g} m",
            "payload": f"{self.tip.payload if self.tip and self.tip.payload else 0:g} kg",
            "postures": ", ".join(self.postures) or "none",
        }

    @property
    def reach(self) -> float:
        """Length of the straight boom, pivot of section 1 to the tip, m."""
        return sum(section.length for section in self.sections)

    def pins_of(self, owner: str) -> tuple[Pin, ...]:
        """Pins with clearance of ``cylinder_i`` or ``joint_i``, in the order in which the scene lists them."""
        pins = () if self.clearance is None else self.clearance.pins
        return tuple(pin for pin in pins if pin.at.split(".")[0] == owner and pin.radial_clearance >= IDEAL_BELOW)

    def modes_of(self, index: int) -> int:
        """Bending coordinates per flexible part of section `index` (0-based)."""
        own = self.sections[index].modes
        return self.modes if own is None else own

    def has_axial(self, index: int) -> bool:
        """Return True if the flexible parts of section `index` (0-based) stretch."""
        own = self.sections[index].axial
        return self.axial if own is None else own

    def has_geometric(self, index: int) -> bool:
        """Return True if the flexible parts of section `index` (0-based) have geometric stiffness."""
        own = self.sections[index].geometric
        return self.geometric if own is None else own

    def is_flexible(self, index: int) -> bool:
        """Return True if section `index` (0-based) bends."""
        return self.sections[index].beam is not None and self.modes_of(index) > 0


DEEP = 2.4  # depth of a drawn section over its radius of gyration: about that of a thin-walled box
SHARE = 0.05  # of its length, where a section has no A and I


def section_depth(scene: Scene, i: int) -> float:
    """Depth (m) to draw section `i` (0-based) with: its height, that of a box with its A and I, or a share of its length."""
    section = scene.sections[i]
    if section.height is not None:
        return section.height
    if section.A is None or section.I is None:
        return SHARE * section.length
    return DEEP * math.sqrt(section.I / section.A)
