"""Sensor model: where angle sensors and inclinometers are mounted, and what an accelerometer reads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..compiler.plan import Plan
from ..errors import UsageError
from ..kernels.jit import inner
from ..kernels.tables import JOINT_A, JOINT_B
from ..types import Mount

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


class Mounting(NamedTuple):
    """Mounting of the angle sensors of a boom, one for each joint.

    An encoder reads the angle of its joint. An inclinometer reads the angle of the root, or of the head, of its section to
    the horizontal, and is compared with just that: nothing measured by another sensor enters, so a fault of one inclinometer
    stays in its own residual. Readings of an inclinometer may differ by whole turns. It finds the vertical by its own
    acceleration, so it reads atan2(level, g + lift) too much while its place accelerates along the level and upwards, unless
    it is compensated.

    Attributes
    ----------
    frames : ndarray of int, shape (n,)
        Frames of the chain that the sensors are fixed to if they are inclinometers.
    absolute, sways : ndarray of bool, shape (n,)
        True for an inclinometer, and for one that is not compensated.
    """

    frames: NDArray[np.int64]
    absolute: NDArray[np.bool_]
    sways: NDArray[np.bool_]


def section_frames(plan: Plan) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the frames of root and head of every section, shape (n,) each."""
    kinds = plan.tables.operations.kind
    roots = np.flatnonzero((kinds == JOINT_A) | (kinds == JOINT_B)) + 1
    return roots, np.append(roots[1:] - 1, len(kinds))


def mounting_of(plan: Plan, mounts: Sequence[Mount | None]) -> Mounting:
    """Return the mounting of the sensors of each joint; None is an encoder, and no mounts at all are encoders.

    Raises
    ------
    UsageError
        Their number is not that of the joints.
    """
    mounts = mounts or [None] * plan.joints
    if len(mounts) != plan.joints:
        raise UsageError(f"mounts has {len(mounts)} entries, not {plan.joints}. Give one for each joint, or none.")
    roots, heads = section_frames(plan)
    is_head = np.array([str(mount).startswith("head") for mount in mounts])
    absolute, sways = ([mount is not None for mount in mounts], [mount in ("root", "head") for mount in mounts])
    return Mounting(np.where(is_head, heads, roots), np.array(absolute), np.array(sways))
