"""What a step of a model costs: counted from what it holds, and measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..analysis.march import march
from ..plan.compile import compile_scene
from ..records import Array
from ..scene.parts import Scene
from .deviation import Course

SHARE = 0.05  # of a coordinate of a mass, or of a point that turns finitely, in unknowns; measured on the default boom


def unknowns(scene: Scene) -> int:
    """Unknowns of one step."""
    return len(compile_scene(scene).names)


def size(scene: Scene) -> float:
    """Cost of a step, counted in unknowns: the same on every machine and at any load, so that choices can be made by it."""
    plan = compile_scene(scene)
    masses, finite = len(plan.masses) - len(plan.names), int(plan.tables.beams.finite.sum())
    return len(plan.names) + SHARE * (masses + finite)


def step_times(scenes: Sequence[Scene], course: Course, rounds: int) -> Array:
    """Time (s) of a step of every scene on the move of a course, shape (scenes,): the least of `rounds` interleaved runs."""
    motion, least = course.motion, np.full(len(scenes), np.inf)
    for _ in range(rounds):
        for k, scene in enumerate(scenes):
            run = march(scene, motion, motion.duration, course.step, every=course.every, angles=motion.angles)
            least[k] = min(least[k], run.seconds / run.steps)
    return least
