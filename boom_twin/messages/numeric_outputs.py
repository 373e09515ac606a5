"""Numbers of a prediction and of its estimate: their names, the messages that have them, and rows of them.

Each number stands once in a row, by the names of `number_names`, in the axes of the model. The model's plane (x forward, y up)
is the x-z plane of ``base_link``, so a positive turn is one about its -y (REP-103).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np

from ..deviation.estimate_row import FORCE_VARIANCE, MODES
from ..kernels.tip_joints import write_derived
from ..predictions import Estimate, Prediction
from ..twin.blocks import EstimateBlock, PredictionBlock, row_of
from ..types import Array, Integers
from .cdr_encoder import NumberFields
from .topic_table import TIP_JOINTS, Output
from .type_store import fill_xz

TIP_NUMBERS = (
    "tip_x", "tip_y", "tip_angle",
    "velocity_x", "velocity_y", "angular_velocity",
    "acceleration_x", "acceleration_y", "angular_acceleration",
    "displacement_x", "displacement_y",
)  # fmt: skip
COVARIANCE = "variance_xx", "covariance_xy", "covariance_xa", "variance_yy", "covariance_ya", "variance_aa"
"""Upper triangle of a covariance by rows, of x, y and angle."""
ESTIMATED_NUMBERS = (
    "estimate_x", "estimate_y", "estimate_angle",
    "estimate_velocity_x", "estimate_velocity_y", "estimate_angular_velocity",
    "estimate_acceleration_x", "estimate_acceleration_y", "estimate_angular_acceleration",
    "load_x", "load_y",
    *(f"{kind}_{j}" for kind in ("mode", "mode_rate") for j in range(1, MODES + 1)),
    *(f"{kind}{entry}" for kind in ("", "velocity_", "acceleration_") for entry in COVARIANCE),
)  # fmt: skip
"""Numbers of an estimate's row, see `boom_twin.deviation.estimate_row.WIDTH`, up to its variances of the load."""
TURN = ("sine_of_half", "cosine_of_half")  # sine and cosine of half the angle of the estimate, for a quaternion

JOINTS = len(TIP_NUMBERS)  # behind the joints' angles: strokes, cylinders' forces, the tip's joints, the estimate


def number_names(joints: int) -> tuple[str, ...]:
    """Return the names of the numbers (SI units) for a boom with `joints` joints, in the order of a row."""
    own = [f"{kind}_{i}" for kind in ("joint", "stroke", "force") for i in range(1, joints + 1)]
    return *TIP_NUMBERS, *own, *TIP_JOINTS, *ESTIMATED_NUMBERS, *TURN


Placer = Callable[[Any, NumberFields], None]
"""Function that places the fields for numbers in an empty message.

Names of fields are those of `number_names`. A minus before a name reverses the sign in the message.
"""


def _put_motion(motion: Any, fields: NumberFields, kind: str, source: str = "") -> None:
    fill_xz(motion.linear, fields.named(f"{source}{kind}_x", f"{source}{kind}_y"))
    (motion.angular.y,) = fields.named(f"-{source}angular_{kind}")


PREDICTED: tuple[tuple[Output, Placer], ...] = (
    (Output.TIP_DISPLACEMENT, lambda msg, fields: fill_xz(msg.vector, fields.named("displacement_x", "displacement_y"))),
    (Output.TIP_POSITION, lambda msg, fields: fill_xz(msg.point, fields.named("tip_x", "tip_y"))),
    (Output.TIP_ACCELERATION, lambda msg, fields: _put_motion(msg.accel, fields, "acceleration")),
)
"""Outputs of a prediction (m; m; m/s^2 and rad/s^2) in the order of a bag, before ``joint_states``."""


def _put_pose(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.pose.pose.position, fields.named("estimate_x", "estimate_y"))
    msg.pose.pose.orientation.y, msg.pose.pose.orientation.w = fields.named("-sine_of_half", "cosine_of_half")
    _put_covariance(msg.pose, fields, "")


def _put_estimate(holder: Any, motion: Any, fields: NumberFields, kind: str) -> None:
    _put_motion(motion, fields, kind, "estimate_")
    _put_covariance(holder, fields, f"{kind}_")


def _put_modes(msg: Any, fields: NumberFields) -> None:
    numbers = range(1, MODES + 1)
    msg.name = [f"mode_{j}" for j in numbers]
    msg.position = np.array(fields.named(*(f"mode_{j}" for j in numbers)))
    msg.velocity = np.array(fields.named(*(f"mode_rate_{j}" for j in numbers)))


TURNED = "covariance_xa", "covariance_ya"  # have the other sign in a message, where the turn counts about -y


def _put_covariance(holder: Any, fields: NumberFields, kind: str) -> None:
    """Place the covariance of x, z and the turn about y."""
    table = np.zeros((6, 6))
    for (row, column), entry in zip(combinations_with_replacement((0, 2, 4), 2), COVARIANCE, strict=True):
        for place in {(row, column), (column, row)}:
            (table[place],) = fields.named(f"{'-' if entry in TURNED else ''}{kind}{entry}")
    holder.covariance = table.ravel()


ESTIMATED: tuple[tuple[Output, Placer], ...] = (
    (Output.ESTIMATE_POSE, _put_pose),
    (Output.ESTIMATE_TWIST, lambda msg, fields: _put_estimate(msg.twist, msg.twist.twist, fields, "velocity")),
    (Output.ESTIMATE_ACCELERATION, lambda msg, fields: _put_estimate(msg.accel, msg.accel.accel, fields, "acceleration")),
    (Output.ESTIMATE_LOAD, lambda msg, fields: fill_xz(msg.wrench.force, fields.named("load_x", "load_y"))),
    (Output.ESTIMATE_MODES, _put_modes),
)
"""Outputs of an estimate in the order of a bag, after ``joint_states``."""


def selection(names: Sequence[str], joints: int) -> tuple[Integers, Array]:
    """Return the places and the signs (1 or -1) of a template's numbers in the row of a boom with `joints` joints."""
    places = {name: place for place, name in enumerate(number_names(joints))}
    chosen = np.array([places[name.removeprefix("-")] for name in names], np.int64)
    return chosen, np.array([-1.0 if name.startswith("-") else 1.0 for name in names])


class Chain(NamedTuple):
    """Geometry of the boom: pivot of its first joint, shape (2,), m, and lengths of its sections, shape (n,), m."""

    pivot: Array
    lengths: Array


def number_rows(chain: Chain, p: Prediction | PredictionBlock | None, e: Estimate | EstimateBlock | None, count: int) -> Array:
    """Return the numbers of `count` predictions and their estimates, shape (count, all); NaN if missing."""
    joints = len(chain.lengths)
    at = JOINTS + 3 * joints
    numbers = np.full((count, at + len(TIP_JOINTS) + len(ESTIMATED_NUMBERS) + len(TURN)), math.nan)
    if p is not None:
        numbers[:, :2], numbers[:, 2] = p.tip_position, p.tip_angle
        numbers[:, 3:5], numbers[:, 5] = p.tip_velocity, p.tip_angular_velocity
        numbers[:, 6:8], numbers[:, 8] = p.tip_acceleration, p.tip_angular_acceleration
        numbers[:, 9:JOINTS], numbers[:, JOINTS : JOINTS + joints] = p.tip_displacement, p.joints
        numbers[:, at - 2 * joints : at - joints], numbers[:, at - joints : at] = p.strokes, p.cylinder_forces
    if e is not None:
        rows = e.rows if isinstance(e, EstimateBlock) else row_of(e)[np.newaxis]
        numbers[:, at + 3 : -2] = rows[:, :FORCE_VARIANCE]
    write_derived(chain.pivot, chain.lengths, numbers, JOINTS, at)
    derived = numbers[:, at : at + 3]
    derived[np.isnan(derived)] = math.nan  # the processor decides which of two NaN a sum has
    return numbers
