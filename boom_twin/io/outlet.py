"""From a report of the twin to messages.

The model's plane (x forward, y up) is the x-z plane of ``base_link``, so a positive turn is one about its -y (REP-103).
"""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING, Any

from ..records import Prediction, Report, Residuals
from ..scene.parts import Scene
from ..scene.passive import PassiveJoints
from ..settings import Settings
from .changes import encode
from .markers import ShapeMarkers
from .places import fill_header, fill_xz
from .topics import TYPES, Output

if TYPE_CHECKING:
    from .factory import Types

Messages = list[tuple[Output, Any]]


class Outlet:
    """Fills messages; the same reports in the same order give the same messages.

    The messages are the outlet's own and filled anew at the next call: publish or write them before.

    Parameters
    ----------
    types : Types
        Makes the empty messages.
    scene : Scene
        What the reports are about.
    settings : Settings
        How ``shape`` is drawn.
    """

    def __init__(self, types: Types, scene: Scene, settings: Settings) -> None:
        self._types, count = types, len(scene.joints)
        self._passive = PassiveJoints(scene)
        self._names = [f"{kind}_{number}" for kind in ("joint", "cylinder") for number in range(1, count + 1)]
        self._markers = ShapeMarkers(types, settings.exaggeration, settings.force_scale)
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
        if report.change is not None:
            messages.append((Output.CHANGES, encode(report.change)))
        if prediction is not None and prediction.shape is not None:
            messages.append((Output.SHAPE, self._markers.fill(prediction)))
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
        fill_xz(msg.vector, prediction.tip_displacement)
        return msg

    def _position(self, prediction: Prediction) -> Any:
        msg = self._message(Output.TIP_POSITION, prediction.stamp)
        fill_xz(msg.point, prediction.tip_position)
        return msg

    def _acceleration(self, prediction: Prediction) -> Any:
        msg = self._message(Output.TIP_ACCELERATION, prediction.stamp)
        fill_xz(msg.accel.linear, prediction.tip_acceleration)
        msg.accel.angular.y = -float(prediction.tip_angular_acceleration)
        return msg

    def _joint_states(self, prediction: Prediction) -> Any:
        """Joints first, cylinders after them, passive joints last where there is a shape; only cylinders have an effort."""
        msg, count = self._message(Output.JOINT_STATES, prediction.stamp), len(prediction.joints)
        names, passive = self._names, []
        if prediction.shape is not None:
            names, passive = [*self._names, *self._passive.names], self._passive.positions(prediction.joints)
        msg.name = names
        msg.position = self._types.doubles(prediction.joints.tolist() + prediction.strokes.tolist() + passive)
        msg.effort = self._types.doubles([nan] * count + prediction.cylinder_forces.tolist() + [nan] * len(passive))
        return msg

    def _residuals(self, residuals: Residuals, place: int) -> Any:
        """Named channels: ``position`` residual, ``velocity`` normalised residual, ``effort`` standard deviation."""
        msg = self._message(Output.RESIDUALS, residuals.stamp, place)
        msg.name = list(residuals.names)
        msg.position = self._types.doubles(residuals.values)
        msg.velocity = self._types.doubles(residuals.normalised)
        msg.effort = self._types.doubles(residuals.sigmas)
        return msg
