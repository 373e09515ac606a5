"""What sensors would read of a boom at rest."""

from __future__ import annotations

import math

import numpy as np

from ..chain.program import State
from ..chain.step import observe
from ..mounting import Mounting
from ..plan.plan import Plan
from ..records import Array


class Reading:
    """Angles (n) in rad, the IMU's x and z in m/s^2, then the tip's x and y in m: shape (n + 4,).

    Parameters
    ----------
    plan : Plan
    mounting : Mounting
        Of the angle sensors.
    """

    def __init__(self, plan: Plan, mounting: Mounting) -> None:
        self._plan, self._mounting = plan, mounting
        self._row = np.empty(2 * plan.joints + 9)

    def of(self, state: State) -> Array:
        """Of an equilibrium."""
        n, row = self._plan.joints, self._row
        observe(self._plan.tables, state, row)
        x, y, angle = state.frames[-1, 0], state.frames[-1, 1], state.frames[-1, 2]
        c, s = math.cos(angle), math.sin(angle)
        gx, gy = self._plan.tables.gravity
        angles = self._mounting.expected(row[:n], state)
        return np.concatenate([angles, [-c * gx - s * gy, s * gx - c * gy, x, y]])

    def forces(self, state: State) -> Array:
        """Of the cylinders, N, positive in tension, shape (n,)."""
        n = self._plan.joints
        observe(self._plan.tables, state, self._row)
        return self._row[n : 2 * n].copy()
