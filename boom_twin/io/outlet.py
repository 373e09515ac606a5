"""From a report of the twin to messages.

The model's plane (x forward, y up) is the x-z plane of ``base_link``, so a positive turn is one about its -y (REP-103).
"""

from __future__ import annotations

from functools import lru_cache
from math import nan
from typing import Any

from ..records import Array, Prediction, Report, Residuals
from .factory import Types
from .topics import TYPES, Output

FRAME = "base_link"
LINE_WIDTH = 0.12
LINE_COLOUR = (0.90, 0.45, 0.10, 1.0)
_LINE_STRIP, _ADD = 4, 0

Messages = list[tuple[Output, Any]]


class Outlet:
    """Fills messages; the same reports in the same order give the same messages.

    The messages are the outlet's own and filled anew at the next call: publish or write them before.

    Parameters
    ----------
    types : Types
        Makes the empty messages.
    """

    def __init__(self, types: Types) -> None:
        self._types = types
        self._made: dict[tuple[Output, int], Any] = {}

    def fill(self, report: Report) -> Messages:
        """The messages of one report, in the order of `Output`.

        Returns
        -------
        list of (Output, message)
            ``tip_displacement`` (m), ``tip_position`` (m), ``tip_acceleration`` (m/s^2, rad/s^2), ``joint_states``, and
            ``shape`` where it has one, if there is a prediction; ``residuals`` for each set of them.
        """
        messages: Messages = []
        if (prediction := report.prediction) is not None:
            messages += [
                (Output.TIP_DISPLACEMENT, self._displacement(prediction)),
                (Output.TIP_POSITION, self._position(prediction)),
                (Output.TIP_ACCELERATION, self._acceleration(prediction)),
                (Output.JOINT_STATES, self._joint_states(prediction)),
            ]
        for place, residuals in enumerate(report.residuals):
            messages.append((Output.RESIDUALS, self._residuals(residuals, place)))
        if prediction is not None and prediction.shape is not None:
            messages.append((Output.SHAPE, self._shape(prediction.stamp, prediction.shape)))
        return messages

    def _message(self, key: Output, stamp: int, place: int = 0) -> Any:
        """The message number `place` of `key` in this report, with its header filled."""
        msg = self._made.get((key, place))
        if msg is None:
            msg = self._made[key, place] = self._types.make(TYPES[key])
        fill_header(msg.header, stamp)
        return msg

    def _displacement(self, prediction: Prediction) -> Any:
        msg = self._message(Output.TIP_DISPLACEMENT, prediction.stamp)
        _fill_xz(msg.vector, prediction.tip_displacement)
        return msg

    def _position(self, prediction: Prediction) -> Any:
        msg = self._message(Output.TIP_POSITION, prediction.stamp)
        _fill_xz(msg.point, prediction.tip_position)
        return msg

    def _acceleration(self, prediction: Prediction) -> Any:
        msg = self._message(Output.TIP_ACCELERATION, prediction.stamp)
        _fill_xz(msg.accel.linear, prediction.tip_acceleration)
        msg.accel.angular.y = -float(prediction.tip_angular_acceleration)
        return msg

    def _joint_states(self, prediction: Prediction) -> Any:
        """Joints first, cylinders after them; a joint has no effort of its own."""
        msg, count = self._message(Output.JOINT_STATES, prediction.stamp), len(prediction.joints)
        msg.name = list(_joint_state_names(count))
        msg.position = self._types.doubles(prediction.joints.tolist() + prediction.strokes.tolist())
        msg.effort = self._types.doubles([nan] * count + prediction.cylinder_forces.tolist())
        return msg

    def _residuals(self, residuals: Residuals, place: int) -> Any:
        """Named channels: ``position`` residual, ``velocity`` normalised residual, ``effort`` standard deviation."""
        msg = self._message(Output.RESIDUALS, residuals.stamp, place)
        msg.name = list(residuals.names)
        msg.position = self._types.doubles(residuals.values)
        msg.velocity = self._types.doubles(residuals.normalised)
        msg.effort = self._types.doubles(residuals.sigmas)
        return msg

    def _shape(self, stamp: int, line: Array) -> Any:
        msg = self._types.make(TYPES[Output.SHAPE])
        marker = self._types.make("visualization_msgs/msg/Marker")
        fill_header(marker.header, stamp)
        marker.ns, marker.type, marker.action = "boom", _LINE_STRIP, _ADD
        marker.pose.orientation.w, marker.scale.x = 1.0, LINE_WIDTH
        marker.color.r, marker.color.g, marker.color.b, marker.color.a = LINE_COLOUR
        marker.points = [self._point(place) for place in line]
        msg.markers = [marker]
        return msg

    def _point(self, place: Array) -> Any:
        point = self._types.make("geometry_msgs/msg/Point")
        _fill_xz(point, place)
        return point


@lru_cache(maxsize=8)
def _joint_state_names(count: int) -> tuple[str, ...]:
    return tuple(f"{kind}_{number}" for kind in ("joint", "cylinder") for number in range(1, count + 1))


def fill_header(header: Any, stamp: int, frame: str = FRAME) -> None:
    """Put a stamp (nanoseconds) and a frame into a ``std_msgs/Header``."""
    header.stamp.sec, header.stamp.nanosec = divmod(stamp, 1_000_000_000)
    header.frame_id = frame


def _fill_xz(target: Any, values: Array) -> None:
    """Model x to x, model y to z; y is 0."""
    target.x, target.y, target.z = float(values[0]), 0.0, float(values[1])
