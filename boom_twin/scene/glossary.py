"""The meaning and unit of every key of a scene file, as error messages quote them."""

from __future__ import annotations

from pydantic import BaseModel

from ..kernels.elements.pin_contact import LAWS
from .schema import (
    Base,
    Clearance,
    ContactLaw,
    Cylinder,
    CylinderPart,
    Joint,
    Material,
    Pin,
    RigidPart,
    Scene,
    Section,
    Tip,
)

_LAWS = tuple(LAWS)

MEANING: dict[type[BaseModel], dict[str, str]] = {
    Scene: {
        "description": "text",
        "gravity": "[x, y] in m/s^2, for example [0.0, -9.81]",
        "material": "a block with E (Pa)",
        "base": "a block with pivot and cylinder_pin",
        "modes": "the number of bending coordinates per flexible part: a whole number from 0 to 10",
        "axial": "true or false, whether flexible parts stretch",
        "geometric": "true or false, whether flexible parts have geometric stiffness",
        "sections": "a list with one block per section",
        "joints": "a list with one block per joint",
        "tip": "a block with payload (kg)",
        "clearance": "a block with pins, and contact and treatment if they are not the usual ones",
        "line_fill": "the concrete in the pipe line, kg/m",
        "postures": "a block of names, each with a list of section angles in degrees",
    },
    Material: {
        "name": "text",
        "E": "Young's modulus in Pa, 2.06e11 for steel",
        "nu": "Poisson's ratio, above -1 and at most 0.5",
        "rho": "the density in kg/m^3",
    },
    Base: {
        "pivot": "[x, y] of the pin of section 1, m",
        "cylinder_pin": "[x, y] of the barrel pin of cylinder 1, m",
        "inclination": "the turn of the base, rad",
    },
    Section: {
        "length": "the length from pivot to pivot, m",
        "beam": "[x0, x1] of the flexible part, m from the inboard pivot",
        "A": "the area of the cross-section, m^2",
        "I": "the second moment of area, m^4",
        "rho_A": "the mass per metre, kg/m",
        "rho_I": "the rotary inertia per metre, kg m",
        "beta": "the stiffness-proportional damping, s",
        "height": "the outer height of the box, m",
        "modes": "the number of bending coordinates per flexible part: a whole number from 0 to 10",
        "axial": "true or false, whether flexible parts stretch",
        "geometric": "true or false, whether flexible parts have geometric stiffness",
        "root": "a block with mass, com, inertia of the rigid inboard part",
        "head": "a block with mass, com, inertia of the rigid outboard part",
        "rod_pin": "[x, y] of the rod pin of cylinder 1, m",
    },
    RigidPart: {
        "mass": "the mass in kg",
        "com": "[x, y] of the centre of mass in the axes of the section, m",
        "inertia": "the inertia about the centre of mass in kg m^2",
    },
    Joint: {
        "kind": "A, B1, B2 or B3",
        "range_deg": "[low, high] of the relative joint angle, degrees",
        "C": "[x, y] of the barrel pin from the outboard pivot of the section before, m",
        "D": "[x, y] of the pivot of link L from the outboard pivot of the section before, m",
        "E": "[x, y] of the pin of link R from the pivot of its own section, m",
        "lL": "the length of link L, m",
        "lR": "the length of link R, m",
        "R": "[along, left], the place of the rod pin on its link, m",
        "mL": "the mass of link L, kg",
        "mR": "the mass of link R, kg",
        "cylinder": "a block with closed_length and max_stroke",
    },
    Cylinder: {
        "k": "the stiffness of the oil spring, N/m",
        "d": "the viscous damping, N s/m",
        "closed_length": "the length from pin to pin at stroke 0, m",
        "max_stroke": "the largest stroke, m",
        "barrel": "a block with mass, inertia, com",
        "rod": "a block with mass, inertia, com",
    },
    CylinderPart: {
        "mass": "the mass in kg",
        "inertia": "the inertia about the centre of mass in kg m^2",
        "com": "the distance of the centre of mass from the part's pin, m",
    },
    Clearance: {
        "treatment": "contact or spring-damper",
        "contact": "a block with law, exponent, restitution, friction",
        "pins": "a list with one block per pin",
    },
    ContactLaw: {
        "law": f"{', '.join(_LAWS[:-1])} or {_LAWS[-1]}",
        "exponent": "the exponent of the penetration, 1.3 to 3; 1.5 for Hertz's",
        "restitution": "the coefficient of restitution, above 0 and at most 1",
        "friction": "Coulomb's coefficient of friction, 0 to 2",
        "bush": "a block with E (Pa) and nu of the bush, if it is not of the boom's material",
    },
    Pin: {
        "at": "which pin: cylinder_i.rod, cylinder_i.barrel, joint_i.pivot, joint_i.link_L, joint_i.link_R or joint_i.Q",
        "pin_radius": "the radius of the pin, m",
        "radial_clearance": "the radius of the hole less that of the pin, m",
    },
    Tip: {"payload": "the point mass at the outboard pivot of the last section, kg"},
}

HOME: dict[type[BaseModel], str] = {
    Scene: "the top level",
    Material: "material",
    Base: "base",
    Section: "sections[i]",
    RigidPart: "sections[i].root or sections[i].head",
    Joint: "joints[i]",
    Cylinder: "joints[i].cylinder",
    CylinderPart: "joints[i].cylinder.barrel or .rod",
    Clearance: "clearance",
    ContactLaw: "clearance.contact",
    Pin: "clearance.pins[i]",
    Tip: "tip",
}

BLOCKS: dict[type[BaseModel], dict[str, type[BaseModel]]] = {
    Scene: {"material": Material, "base": Base, "sections": Section, "joints": Joint, "clearance": Clearance, "tip": Tip},
    Section: {"root": RigidPart, "head": RigidPart},
    Joint: {"cylinder": Cylinder},
    Clearance: {"contact": ContactLaw, "pins": Pin},
    ContactLaw: {"bush": Material},
    Cylinder: {"barrel": CylinderPart, "rod": CylinderPart},
}
