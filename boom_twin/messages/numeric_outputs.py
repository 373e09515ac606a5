"""Outputs with numbers of a prediction and of its estimate, and the places of the numbers in the messages.

The model's plane (x forward, y up) is the x-z plane of ``base_link``, so a positive turn is one about its -y (REP-103).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..deviation.estimate_row import MODES
from ..twin.blocks import Integers
from ..types import Array
from .cdr_encoder import NumberFields
from .message_fields import fill_xz
from .prediction_numbers import COVARIANCE, ESTIMATED_NUMBERS, number_names
from .topic_table import Output


class NumericOutput(NamedTuple):
    """Output with one message for every prediction or estimate, and the numbers that its message has.

    ``put`` gets an empty message and places the fields for numbers in it. ``numbers`` names these numbers in that order, see
    `boom_twin.messages.prediction_numbers.number_names`. A minus before a name reverses the sign in the message.
    """

    output: Output
    put: Callable[[Any, NumberFields], None]
    numbers: tuple[str, ...]


def put_vector(msg: Any, fields: NumberFields) -> None:
    """Place the fields of x and z in a Vector3Stamped."""
    fill_xz(msg.vector, fields.row(2))


def _put_motion(motion: Any, fields: NumberFields) -> None:
    fill_xz(motion.linear, fields.row(2))
    motion.angular.y = fields.double()


_ACCELERATION = "acceleration_x", "acceleration_y", "-angular_acceleration"
PREDICTED = (
    NumericOutput(Output.TIP_DISPLACEMENT, put_vector, ("displacement_x", "displacement_y")),
    NumericOutput(Output.TIP_POSITION, lambda msg, fields: fill_xz(msg.point, fields.row(2)), ("tip_x", "tip_y")),
    NumericOutput(Output.TIP_ACCELERATION, lambda msg, fields: _put_motion(msg.accel, fields), _ACCELERATION),
)
"""Outputs of a prediction (m; m; m/s^2 and rad/s^2) in the order of a bag, before ``joint_states``."""


def _put_pose(msg: Any, fields: NumberFields) -> None:
    fill_xz(msg.pose.pose.position, fields.row(2))
    msg.pose.pose.orientation.y, msg.pose.pose.orientation.w = fields.row(2)
    _put_covariance(msg.pose, fields)


def _put_estimate(holder: Any, motion: Any, fields: NumberFields) -> None:
    _put_motion(motion, fields)
    _put_covariance(holder, fields)


def _put_modes(msg: Any, fields: NumberFields) -> None:
    msg.name = [f"mode_{j}" for j in range(1, MODES + 1)]
    msg.position, msg.velocity = (np.array(fields.row(MODES)) for _ in range(2))


def _put_covariance(holder: Any, fields: NumberFields) -> None:
    """Place the covariance of x, z and the turn about y. The upper triangle by rows comes first, then its mirrored entries."""
    table, (rows, columns) = np.zeros((6, 6)), np.triu_indices(3)
    places = np.array([0, 2, 4])
    table[places[rows], places[columns]] = fields.row(6)
    off = rows != columns
    table[places[columns[off]], places[rows[off]]] = fields.row(3)
    holder.covariance = table.ravel()


TURNED = "covariance_xa", "covariance_ya"  # have the other sign in a message, where the turn counts about -y


def _covariance(kind: str) -> tuple[str, ...]:
    """Return the names of the numbers of `_put_covariance`."""
    xx, xy, xa, yy, ya, aa = (f"{'-' if entry in TURNED else ''}{kind}{entry}" for entry in COVARIANCE)
    return xx, xy, xa, yy, ya, aa, xy, xa, ya


def _motion(kind: str) -> tuple[str, ...]:
    """Return the names of the numbers of `_put_estimate`."""
    return f"estimate_{kind}_x", f"estimate_{kind}_y", f"-estimate_angular_{kind}", *_covariance(f"{kind}_")


_POSE = "estimate_x", "estimate_y", "-sine_of_half", "cosine_of_half", *_covariance("")
_MODES = tuple(name for name in ESTIMATED_NUMBERS if name.startswith("mode_"))
ESTIMATED = (
    NumericOutput(Output.ESTIMATE_POSE, _put_pose, _POSE),
    NumericOutput(
        Output.ESTIMATE_TWIST, lambda msg, fields: _put_estimate(msg.twist, msg.twist.twist, fields), _motion("velocity")
    ),
    NumericOutput(
        Output.ESTIMATE_ACCELERATION,
        lambda msg, fields: _put_estimate(msg.accel, msg.accel.accel, fields),
        _motion("acceleration"),
    ),
    NumericOutput(Output.ESTIMATE_LOAD, lambda msg, fields: fill_xz(msg.wrench.force, fields.row(2)), ("load_x", "load_y")),
    NumericOutput(Output.ESTIMATE_MODES, _put_modes, _MODES),
)
"""Outputs of an estimate in the order of a bag, after ``joint_states``."""


def selection(names: Sequence[str], joints: int) -> tuple[Integers, Array]:
    """Return the places and the signs (1 or -1) of `NumericOutput.numbers` in the row of a boom with `joints` joints."""
    places = {name: place for place, name in enumerate(number_names(joints))}
    chosen = np.array([places[name.removeprefix("-")] for name in names], np.int64)
    return chosen, np.array([-1.0 if name.startswith("-") else 1.0 for name in names])
