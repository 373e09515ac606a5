"""Outline of a boom whose sections are straight and whose cylinders are rigid."""

from __future__ import annotations

import numpy as np

from ..compiler.plan import Plan
from ..kernels.transfer.forward_kinematics import place
from ..scene.kinematics import rigid_chain
from ..scene.schema import Scene
from ..types import Array
from .equilibrium import outline, set_undeformed


class UndeflectedBoom:
    """Points of `boom_twin.analysis.equilibrium.outline` of a boom that does not bend."""

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._plan, self._pivot = plan, np.array(scene.base.pivot)
        self._lengths = np.array([section.length for section in scene.sections])
        self._reach = np.concatenate([[0.0], np.cumsum(self._lengths)])
        along = self._points_along(np.radians([sum(joint.range_deg) / 2 for joint in scene.joints]))
        self._section = np.clip(np.searchsorted(self._reach, along, side="right") - 1, 0, len(self._lengths))
        self._beyond = np.where(self._section < len(self._lengths), np.maximum(along - self._reach[self._section], 0.0), 0.0)

    @property
    def middles(self) -> list[int]:
        """Number of the point nearest to the middle of each section."""
        along = self._reach[self._section] + self._beyond
        return [int(np.argmin(np.abs(along - middle))) for middle in 0.5 * (self._reach[:-1] + self._reach[1:])]

    def at(self, angles: Array) -> Array:
        """Return points (.., k, 2), m, at relative joint `angles` (rad), shape (.., n)."""
        _, pivots = rigid_chain(self._pivot, self._lengths, angles)
        steps = np.diff(pivots, axis=-2) / np.diff(self._reach)[:, None]
        steps = np.concatenate([steps, np.zeros_like(steps[..., :1, :])], axis=-2)
        return np.asarray(steps[..., self._section, :] * self._beyond[:, None] + pivots[..., self._section, :])

    def _points_along(self, angles: Array) -> Array:
        """Return how far along the sections every point is, m, shape (k,), found at some angles."""
        state, work = self._plan.state(), self._plan.work()
        set_undeformed(self._plan, state, angles)
        place(self._plan.tables, state, work)
        line = outline(self._plan, state.frames, work.position)
        steps = np.hypot(*np.diff(line, axis=0, prepend=self._pivot[None, :]).T)
        return np.asarray(np.cumsum(steps))
