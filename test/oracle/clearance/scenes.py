"""Scenes with pins that have clearance."""

from __future__ import annotations

from oracle import booms

RODS = tuple(f"cylinder_{i}.rod" for i in range(1, 5))
LINKS = tuple(f"joint_{i}.{place}" for i in (2, 3, 4) for place in ("pivot", "link_L", "link_R", "Q"))
PINS = (*RODS, *(f"cylinder_{i}.barrel" for i in range(1, 5)), "joint_1.pivot", *LINKS)
RADII = dict(zip(RODS, (0.030, 0.025, 0.025, 0.020), strict=True))


def with_pins(spec, pins, clearance=1e-4, treatment="contact", **contact):
    """A `Scene` of plain dicts `spec` whose `pins` have radial `clearance` (m)."""
    block = [{"at": pin, "pin_radius": RADII.get(pin, 0.025), "radial_clearance": clearance} for pin in pins]
    return booms.scene_of(spec | {"clearance": {"treatment": treatment, "contact": contact, "pins": block}})
