"""From a report of the twin to encoded messages.

The model's plane (x forward, y up) is the x-z plane of ``base_link``, so a positive turn is one about its -y (REP-103).
"""

from __future__ import annotations

from collections.abc import Callable
from math import nan
from typing import Any

import numpy as np

from ..records import Prediction, Report, Residuals
from ..scene.parts import Scene
from ..scene.passive import PassiveJoints
from ..settings import Settings
from .change_messages import encode_changes
from .factory import RosbagsTypes
from .health import encode_health
from .markers import ShapeMarkers
from .places import fill_xz
from .template import Holes, Template, stamped
from .topics import TYPES, Output

Messages = list[tuple[Output, bytes]]


class Outlet:
    """Writes messages as CDR, to be published or kept in a bag; the same reports in the same order give the same bytes.

    Parameters
    ----------
    scene : Scene
        What the reports are about.
    settings : Settings
        How ``shape`` is drawn.
    """

    def __init__(self, scene: Scene, settings: Settings) -> None:
        self._types, count = RosbagsTypes(), len(scene.joints)
        self._passive = PassiveJoints(scene)
        names = [f"{kind}_{number}" for kind in ("joint", "cylinder") for number in range(1, count + 1)]
        self._displacement = self._template(Output.TIP_DISPLACEMENT, _fill_displacement)
        self._position = self._template(Output.TIP_POSITION, _fill_position)
        self._acceleration = self._template(Output.TIP_ACCELERATION, _fill_acceleration)
        self._uncertainty = self._template(Output.TIP_UNCERTAINTY, _fill_displacement)
        self._joints = self._joint_states(names, count, 0)
        self._all_joints = self._joint_states([*names, *self._passive.names], count, len(self._passive.names))
        self._residuals: dict[tuple[str, ...], Template] = {}
        self._markers = ShapeMarkers(settings.exaggeration, settings.force_scale)

    def fill(self, report: Report) -> Messages:
        """The messages of one report.

        Returns
        -------
        list of (Output, bytes)
            ``tip_displacement`` (m), ``tip_position`` (m), ``tip_acceleration`` (m/s^2, rad/s^2), ``joint_states``, and
            ``shape`` where it has one, if there is a prediction; ``residuals`` for each set of them; ``health`` and
            ``tip_uncertainty`` (m) where there is news of it.
        """
        messages: Messages = []
        if (p := report.prediction) is not None:
            acceleration = [*p.tip_acceleration, -p.tip_angular_acceleration]
            messages += [
                (Output.TIP_DISPLACEMENT, self._displacement.fill(p.stamp, p.tip_displacement)),
                (Output.TIP_POSITION, self._position.fill(p.stamp, p.tip_position)),
                (Output.TIP_ACCELERATION, self._acceleration.fill(p.stamp, acceleration)),
                (Output.JOINT_STATES, self._fill_joint_states(p)),
            ]
        messages += [(Output.RESIDUALS, self._fill_residuals(residuals)) for residuals in report.residuals]
        if report.change is not None:
            messages.append((Output.CHANGES, encode_changes(report.change)))
        if (health := report.health) is not None:
            messages.append((Output.HEALTH, encode_health(health)))
            messages.append((Output.TIP_UNCERTAINTY, self._uncertainty.fill(health.stamp, health.tip_sigmas)))
        if p is not None and p.shape is not None:
            messages.append((Output.SHAPE, self._markers.fill(p)))
        return messages

    def _template(self, key: Output, put: Callable[[Any, Holes], None]) -> Template:
        msg, holes = self._types.make(TYPES[key]), Holes()
        stamped(msg.header)
        put(msg, holes)
        return Template(TYPES[key], msg, holes)

    def _joint_states(self, names: list[str], count: int, passive: int) -> Template:
        """Joints first, cylinders after them, passive joints last; only cylinders have an effort."""

        def put(msg: Any, holes: Holes) -> None:
            msg.name, msg.position = names, self._types.doubles(holes.row(2 * count + passive))
            msg.effort = self._types.doubles([nan] * count + holes.row(count) + [nan] * passive)

        return self._template(Output.JOINT_STATES, put)

    def _fill_joint_states(self, p: Prediction) -> bytes:
        """With the passive joints where there is a shape."""
        if p.shape is None:
            return self._joints.fill(p.stamp, np.concatenate([p.joints, p.strokes, p.cylinder_forces]))
        passive = self._passive.positions(p.joints)
        return self._all_joints.fill(p.stamp, np.concatenate([p.joints, p.strokes, passive, p.cylinder_forces]))

    def _fill_residuals(self, residuals: Residuals) -> bytes:
        """Named channels: ``position`` residual, ``velocity`` normalised residual, ``effort`` standard deviation."""

        def put(msg: Any, holes: Holes) -> None:
            msg.name = list(residuals.names)
            msg.position, msg.velocity, msg.effort = (self._types.doubles(holes.row(len(msg.name))) for _ in range(3))

        template = self._residuals.get(residuals.names)
        if template is None:
            template = self._residuals[residuals.names] = self._template(Output.RESIDUALS, put)
        numbers = np.concatenate([residuals.values, residuals.normalised, residuals.sigmas])
        return template.fill(residuals.stamp, numbers)


def _fill_displacement(msg: Any, holes: Holes) -> None:
    fill_xz(msg.vector, holes.row(2))


def _fill_position(msg: Any, holes: Holes) -> None:
    fill_xz(msg.point, holes.row(2))


def _fill_acceleration(msg: Any, holes: Holes) -> None:
    fill_xz(msg.accel.linear, holes.row(2))
    msg.accel.angular.y = holes.double()
