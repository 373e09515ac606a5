"""Sensor model: what angle sensors, inclinometers and the tip IMU would read of the modelled boom."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..compiler.plan import Plan, width_of
from ..errors import UsageError
from ..kernels.jit import SameTypes, inner
from ..kernels.result_row import places_in
from ..kernels.tables import FRAME_ANGLE, FRAME_X, FRAME_Y, JOINT_A, JOINT_B, State
from ..kernels.transfer.time_step import observe
from ..types import Array, Mount

TURN = 2.0 * np.pi


@inner
def specific_force(x: Any, y: Any, c: Any, s: Any) -> tuple[Any, Any]:
    """Return the readings of an accelerometer along two axes, m/s^2; for numbers or for arrays of one shape.

    Parameters
    ----------
    x, y : float or ndarray
        Acceleration less gravity, m/s^2, in the axes of the model.
    c, s : float or ndarray
        Cosine and sine of the angle by which its axes are turned against them.
    """
    return c * x + s * y, c * y - s * x


class Mounting:
    """Angle sensors of a boom, one for each joint.

    An encoder reads the angle of its joint. An inclinometer reads the angle of the root, or of the head, of its section to
    the horizontal, and is compared with just that: nothing measured by another sensor enters, so a fault of one inclinometer
    stays in its own residual. Readings of an inclinometer may differ by whole turns. It is taken as ideal: a real one that
    finds the horizontal by its acceleration is wrong while its section accelerates.

    Parameters
    ----------
    plan : Plan
    inclination : float
        Of the base, rad.
    mounts : sequence of Mount or None
        Of the sensor of each joint; None is an encoder. Empty: encoders all.

    Attributes
    ----------
    roots, frames : ndarray of int, shape (n,)
        Frames of the chain that the sections' roots are, and that the sensors are fixed to if they are inclinometers.
    absolute : ndarray of bool, shape (n,)
        Which of them are.

    Raises
    ------
    UsageError
        Their number is not that of the joints.
    """

    def __init__(self, plan: Plan, inclination: float, mounts: Sequence[Mount | None]) -> None:
        mounts = mounts or [None] * plan.joints
        if len(mounts) != plan.joints:
            raise UsageError(f"mounts has {len(mounts)} entries, not {plan.joints}. Give one for each joint, or none.")
        self.has_any = any(mounts)
        kinds = plan.tables.operations.kind
        roots = np.flatnonzero((kinds == JOINT_A) | (kinds == JOINT_B)) + 1
        heads = np.append(roots[1:] - 1, len(kinds))
        self.roots = roots
        self.frames = np.where([mount == "head" for mount in mounts], heads, roots)
        self.absolute = np.array([mount is not None for mount in mounts])
        self._inclination = inclination

    def expected(self, joints: Array, live: State) -> Array:
        """Return the expected readings, rad, shape (n,), at joint angles `joints` and boom state `live`."""
        if not self.has_any:
            return joints
        return np.where(self.absolute, live.frames[self.frames, FRAME_ANGLE] + self._inclination, joints)


class Reading:
    """Sensor model: angles (n) in rad, the IMU's x and z in m/s^2, then the tip's x and y in m, shape (n + 4,).

    Parameters
    ----------
    plan : Plan
    mounting : Mounting
        Of the angle sensors.
    """

    def __init__(self, plan: Plan, mounting: Mounting) -> None:
        self._plan, self._mounting = plan, mounting
        self._row, self._at = np.zeros(width_of(plan)), places_in(plan.joints, len(plan.pins))
        self._gravity: tuple[float, float] = tuple(plan.tables.gravity.tolist())
        self._observe = SameTypes(observe)

    def of(self, state: State) -> Array:
        """Return the readings at an equilibrium."""
        self._look(state)
        end = state.frames[-1].tolist()
        x, y, angle = end[FRAME_X], end[FRAME_Y], end[FRAME_ANGLE]
        c, s = math.cos(angle), math.sin(angle)
        found, (gx, gy) = np.empty(self._plan.joints + 4), self._gravity
        found[:-4] = self._mounting.expected(self._row[self._at.joints], state)
        found[-4:] = *specific_force(-gx, -gy, c, s), x, y
        return found

    def forces(self, state: State) -> Array:
        """Return the cylinder forces, N, positive in tension, shape (n,)."""
        self._look(state)
        return self._row[self._at.cylinder_forces].copy()

    def _look(self, state: State) -> None:
        """Update the row of results."""
        self._observe(self._plan.tables, state, self._row)
