"""A boom at rest in a posture, on ideal pins or with clearance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from compiled import rest_at
from default_boom import posture_angles, strokes_of_posture


@dataclass(frozen=True)
class Resting:
    """tip (complex, m), joints (n,) rad, tension (n,) N, offsets and forces on the bush of all pins (k,), complex, m and N."""

    tip: complex
    joints: np.ndarray
    tension: np.ndarray
    offsets: np.ndarray
    forces: np.ndarray


def at_rest(scene, posture):
    """Plan, state and scratch of a scene at a posture's strokes."""
    return rest_at(scene, strokes_of_posture(scene, posture), posture_angles(scene, posture))


def resting(scene, posture):
    """`Resting` of a scene in a posture."""
    plan, state, _ = at_rest(scene, posture)
    found = plan.observed(state)
    offsets = found.pins[:, 0] + 1j * found.pins[:, 1]
    sizes = found.pins[:, 2]
    return Resting(complex(*found.tip[0, :2]), found.joints, found.cylinder_forces, offsets, sizes * offsets / np.abs(offsets))
