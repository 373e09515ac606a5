"""How deep a section is to be drawn."""

from __future__ import annotations

import math

from .parts import Scene

DEEP = 2.4  # depth of a drawn section over its radius of gyration: about that of a thin-walled box
SHARE = 0.05  # of its length, where a section has no A and I


def section_depth(scene: Scene, i: int) -> float:
    """Depth (m) to draw section `i` (0-based) with: that of a box with its A and I, else a share of its length."""
    section = scene.sections[i]
    if section.A is None or section.I is None:
        return SHARE * section.length
    return DEEP * math.sqrt(section.I / section.A)
