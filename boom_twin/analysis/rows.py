"""What the kernels write at an instant, taken apart: see `chain.step.observe` and `observe_pins`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..chain.program import State
from ..chain.step import observe, observe_pins
from ..plan.plan import Plan
from ..records import Array

TIP = 9  # x, v, a of tip x, y, angle
PIN = 4  # x and y of the journal's offset, force, contact


@dataclass(frozen=True)
class Rows:
    """m instants of a boom with n joints and k pins with clearance.

    Attributes
    ----------
    joints, cylinder_forces : ndarray, shape (m, n)
        rad, N.
    tip : ndarray, shape (m, 3, 3)
        Position, velocity, acceleration; of x, y (m) and orientation (rad).
    pins : ndarray, shape (m, k, 4)
        Offset x, y of the journal in its bush (m), contact force (N), 1 where they touch.
    """

    joints: Array
    cylinder_forces: Array
    tip: Array
    pins: Array

    def at(self, rows: Array) -> Rows:
        """Some of the instants, by their numbers."""
        return Rows(self.joints[rows], self.cylinder_forces[rows], self.tip[rows], self.pins[rows])


def row_width(plan: Plan) -> int:
    """Numbers of one instant."""
    return 2 * plan.joints + TIP + PIN * len(plan.pins)


def first_row(plan: Plan, state: State) -> Array:
    """The instant in `state`, shape (row_width,)."""
    row = np.zeros(row_width(plan))
    observe(plan.tables, state, row)
    observe_pins(plan.tables, state, row, 2 * plan.joints + TIP)
    return row


def taken_apart(plan: Plan, rows: Array) -> Rows:
    """Rows as the kernels wrote them, shape (m, row_width), by name."""
    n = plan.joints
    end = 2 * n + TIP
    return Rows(
        rows[:, :n], rows[:, n : 2 * n], rows[:, 2 * n : end].reshape(-1, 3, 3), rows[:, end:].reshape(len(rows), -1, PIN)
    )
