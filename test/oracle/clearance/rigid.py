"""Scenes whose flexible sections are rigid and whose cylinders but one are incompressible, and smooth drives."""

from __future__ import annotations

import numpy as np
from oracle import booms


def document(count, index):
    """The default scene's first sections, rigid; all cylinders but `index` (0-based) incompressible."""
    spec = booms.document()
    spec["sections"] = [section | {"modes": 0} for section in spec["sections"][:count]]
    spec["joints"] = spec["joints"][:count]
    for i, joint in enumerate(spec["joints"]):
        if i != index:
            del joint["cylinder"]["k"], joint["cylinder"]["d"]
    return spec


def move(start, travel, duration):
    """Length, rate and acceleration of a drive that goes by `travel` (m) within `duration` (s) and stops."""

    def at(time):
        x = np.clip(time / duration, 0.0, 1.0)
        return (
            start + travel * x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
            travel * 30.0 * x**2 * (1.0 - x) ** 2 / duration,
            travel * 60.0 * x * (1.0 - 3.0 * x + 2.0 * x**2) / duration**2,
        )

    return at
