"""The centre line of a boom with rigid sections and incompressible cylinders, point by point as the deflected one."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from .analysis.posture import set_undeformed
from .analysis.statics import outline
from .chain.place import place
from .plan.plan import Plan
from .records import Array
from .scene.parts import Scene


class Undeflected:
    """Where the points of `boom_twin.analysis.statics.outline` are while nothing bends."""

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._plan, self._pivot = plan, np.array(scene.base.pivot)
        self._lengths = np.array([section.length for section in scene.sections])
        self._reach = np.concatenate([[0.0], np.cumsum(self._lengths)])
        self._middle = np.radians([sum(joint.range_deg) / 2 for joint in scene.joints])

    def at(self, angles: Array) -> Array:
        """Points (k, 2), m, at relative joint `angles` (rad), shape (n,)."""
        heading = np.cumsum(angles)
        steps = self._lengths[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
        pivots = self._pivot + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        return np.stack([np.interp(self._along, self._reach, column) for column in pivots.T], axis=1)

    @cached_property
    def _along(self) -> Array:
        """How far along the sections every point is, m, shape (k,): all pivots are among the points."""
        state, work = self._plan.state(), self._plan.work()
        set_undeformed(self._plan, state, self._middle)
        place(self._plan.tables, state, work)
        line = outline(self._plan, state, work.position)
        steps = np.hypot(*np.diff(line, axis=0, prepend=self._pivot[None, :]).T)
        return np.asarray(np.cumsum(steps))
