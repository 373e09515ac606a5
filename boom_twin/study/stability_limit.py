"""Why a boom has no equilibrium: the share of gravity that it still carries, and its slowest vibration there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.frequencies import natural_modes
from ..analysis.statics import settle
from ..errors import SolverError
from ..plan.compile import compile_scene
from ..scene.kinematics import joint_angles_of_strokes
from .stability_motions import Setup
from .stability_scenes import lighter_gravity

HALVINGS = 20
COUNTED = 1e-6  # relative accuracy of the frequency


@dataclass(frozen=True)
class Limit:
    """`share` of gravity carried at most; `frequency` (Hz) of the slowest vibration just below, and without load."""

    share: float
    frequency: float
    unloaded: float


def limit_of(setup: Setup) -> Limit:
    """Halve the bracket of the load that still has a stable equilibrium, from no load to all of it.

    At a true limit the slowest frequency goes to zero: stiffness is used up, and no equilibrium is near.
    """
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if np.isnan(_slowest(setup, middle)):
            high = middle
        else:
            low = middle
    return Limit(low, _slowest(setup, low), _slowest(setup, 0.0))


def _slowest(setup: Setup, share: float) -> float:
    """First natural frequency (Hz) at the setup's first strokes under `share` of gravity; NaN without an equilibrium."""
    plan = compile_scene(lighter_gravity(setup.scene, share))
    state, work = plan.state(), plan.work()
    strokes = setup.drive(np.zeros(1))[0][0]
    try:
        settle(plan, state, work, strokes, joint_angles_of_strokes(setup.scene, strokes, near=setup.angles))
    except SolverError:
        return float("nan")
    return natural_modes(plan, state, work, 1, COUNTED)[0].frequency
