"""Scenes of textbook problems in the boom's own elements.

A pivot that turns freely is a joint whose cylinder has next to no stiffness and no mass; its links, if any, have no mass either
and close at every angle. A pivot that is driven has a rigid cylinder. Sections of no length put several pivots in one place.
"""

from __future__ import annotations

import numpy as np

from boom_twin import Scene

YOUNG = 2.0e11  # Pa
FREE = {"k": 1e-9, "closed_length": 1.0, "max_stroke": 100.0}
DRIVEN = {"closed_length": 1.0, "max_stroke": 100.0}
NOWHERE = 1e-10  # m, length of a section that only joins two pivots
LINKS = {"D": (0.2, 0.0), "E": (1.0, 0.0), "lL": 1.0, "lR": 1.0}  # D is inside E's circle: the links follow any angle


def scene(sections, joints, gravity=(0.0, -9.81), **extra):
    """A boom on a pivot in the origin, whose first cylinder starts 10 m above it."""
    base = {"pivot": (0.0, 0.0), "cylinder_pin": (0.0, 10.0)}
    first = {"rod_pin": (0.0, 0.1)} | sections[0]
    spec = {"gravity": gravity, "material": {"E": YOUNG}, "base": base, "joints": tuple(joints)}
    return Scene.model_validate(spec | {"sections": (first, *sections[1:])} | extra)


def crank(cylinder):
    """Joint 1 of a scene."""
    return {"kind": "A", "range_deg": (-360.0, 360.0), "cylinder": cylinder}


def six_bar(cylinder, pin=(0.0, 3.0)):
    """A later joint; its cylinder starts at `pin`."""
    return {"kind": "B1", "range_deg": (-360.0, 360.0), "C": tuple(pin), "cylinder": cylinder} | LINKS


def rigid(length, mass, centre, inertia):
    """A rigid section."""
    return {"length": length, "root": {"mass": mass, "com": (centre, 0.0), "inertia": inertia}}


def beam(length, axial, bending, mass, rotary=0.0):
    """A section that bends all along: EA (N), EI (N m^2), mass per metre (kg/m) and its rotary inertia (kg m)."""
    section = {"length": length, "beam": (0.0, length), "A": axial / YOUNG, "I": bending / YOUNG, "rho_A": mass}
    return section | ({"rho_I": rotary} if rotary else {})


def turn(angle):
    """Unit vector at `angle` (rad)."""
    return np.array([np.cos(angle), np.sin(angle)])
