"""Scenes with pins that have clearance; rigid ones of which one cylinder has oil; smooth drives."""

from __future__ import annotations

import numpy as np
from oracle import booms

RODS = tuple(f"cylinder_{i}.rod" for i in range(1, 5))
LINKS = tuple(f"joint_{i}.{place}" for i in (2, 3, 4) for place in ("pivot", "link_L", "link_R", "Q"))
PINS = (*RODS, *(f"cylinder_{i}.barrel" for i in range(1, 5)), "joint_1.pivot", *LINKS)
RADII = dict(zip(RODS, (0.030, 0.025, 0.025, 0.020), strict=True))


def with_pins(spec, pins, clearance=1e-4, treatment="contact", **contact):
    """A `Scene` of plain dicts `spec` whose `pins` have radial `clearance` (m)."""
    block = [{"at": pin, "pin_radius": RADII.get(pin, 0.025), "radial_clearance": clearance} for pin in pins]
    return booms.scene_of(spec | {"clearance": {"treatment": treatment, "contact": contact, "pins": block}})


def rigid_document(count, index):
    """The default scene's first sections, rigid; all cylinders but `index` (0-based) incompressible."""
    spec = booms.document()
    spec["sections"] = [section | {"modes": 0} for section in spec["sections"][:count]]
    spec["joints"] = spec["joints"][:count]
    for i, joint in enumerate(spec["joints"]):
        if i != index:
            del joint["cylinder"]["k"], joint["cylinder"]["d"]
    return spec


def smooth_move(start, travel, duration):
    """Length, rate and acceleration of a drive that goes by `travel` (m) within `duration` (s) and stops."""

    def at(time):
        x = np.clip(time / duration, 0.0, 1.0)
        return (
            start + travel * x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
            travel * 30.0 * x**2 * (1.0 - x) ** 2 / duration,
            travel * 60.0 * x * (1.0 - 3.0 * x + 2.0 * x**2) / duration**2,
        )

    return at
