"""Scenes with pins that have clearance, and what their contact stores."""

from __future__ import annotations

import numpy as np
from oracle import booms

from boom_twin.kernels.elements.pin_contact import SMOOTH

RODS = tuple(f"cylinder_{i}.rod" for i in range(1, 5))
LINKS = tuple(f"joint_{i}.{place}" for i in (2, 3, 4) for place in ("pivot", "link_L", "link_R", "Q"))
PINS = (*RODS, *(f"cylinder_{i}.barrel" for i in range(1, 5)), "joint_1.pivot", *LINKS)
RADII = dict(zip(RODS, (0.030, 0.025, 0.025, 0.020), strict=True))


def with_pins(spec, pins, clearance=1e-4, treatment="contact", **contact):
    """A `Scene` of plain dicts `spec` whose `pins` have radial `clearance` (m)."""
    block = [{"at": pin, "pin_radius": RADII.get(pin, 0.025), "radial_clearance": clearance} for pin in pins]
    return booms.scene_of(spec | {"clearance": {"treatment": treatment, "contact": contact, "pins": block}})


def contact_energy(plan, state):
    """Stored in all contacts, J: K times the integral of d^e over the gap, dg = (1 + s^2/(4 d^2)) dd."""
    total = 0.0
    for row in plan.tables.clearances:
        gap = np.sqrt(np.sum(state.z[row.z : row.z + 2] ** 2) + SMOOTH**2) - row.gap
        root = np.hypot(gap, SMOOTH)
        d, e = (0.5 * (gap + root) if gap > 0.0 else 0.5 * SMOOTH**2 / (root - gap)), row.exponent
        total += row.stiffness * (d ** (e + 1.0) / (e + 1.0) + 0.25 * SMOOTH**2 * d ** (e - 1.0) / (e - 1.0))
    return total
