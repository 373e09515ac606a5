"""The undeformed boom as a first guess: unknowns of a compiled boom from joint angles."""

from __future__ import annotations

import numpy as np

from ..chain.program import State
from ..physics.integrators import X
from ..physics.linkage import link_angles
from ..plan.plan import Plan
from ..records import Array
from ..scene.parts import Scene


def set_undeformed(plan: Plan, state: State, angles: Array) -> None:
    """Write the undeformed boom at relative joint `angles` (rad), shape (n,), into the state; all forces zero."""
    state.z[:] = 0.0
    heading = 0.0
    for i, angle in enumerate(angles):
        z = plan.tables.joints[i].z
        if plan.tables.linkages[i].length_l > 0.0:
            left, right = link_angles(plan.tables.linkages[i], angle)
            state.z[z + 1], state.z[z + 2] = heading + left, heading + right
        heading += angle
        state.z[z] = heading
    state.history[X, : len(state.z)] = state.z


def rigid_tip(scene: Scene, angles: Array) -> Array:
    """Tip (m), shape (2,), of the undeformed boom at relative joint `angles` (rad), shape (n,)."""
    heading = np.cumsum(angles)
    lengths = np.array([section.length for section in scene.sections])
    pivot = np.array(scene.base.pivot)
    return np.asarray(pivot + np.array([lengths @ np.cos(heading), lengths @ np.sin(heading)]))
