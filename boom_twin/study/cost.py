"""What a step of a model costs: counted from what it holds, and measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..analysis.march import march
from ..physics.beam import USUAL
from ..plan.compile import compile_scene
from ..records import Array
from ..scene.parts import Scene
from .deviation import Course

# In unknowns, measured on the default boom (`test/bench/parts.py` shows how well they count):
AXIAL = 0.35  # an axial coordinate; other unknowns count as one
OTHER = 0.6  # more for a flexible part that has not the usual shapes, for which the kernels have code of their own
SHARE = 0.05  # a coordinate of a mass, or a point that turns finitely

STEPS = 400  # that are timed


def unknowns(scene: Scene) -> int:
    """Unknowns of one step."""
    return len(compile_scene(scene).names)


def size(scene: Scene) -> float:
    """Cost of a step, counted in unknowns: the same on every machine and at any load, so that choices can be made by it."""
    plan = compile_scene(scene)
    unknowns, beams = len(plan.names), plan.tables.beams
    other = np.sum((beams.bending != USUAL.bending) | (beams.axial != USUAL.axial))
    shares = len(plan.masses) - unknowns + beams.finite.sum()
    return float(unknowns - (1.0 - AXIAL) * beams.axial.sum() + OTHER * other + SHARE * shares)


def step_times(scenes: Sequence[Scene], course: Course, rounds: int) -> Array:
    """Time (s) of a step of every scene, shape (scenes,): the least of `rounds` interleaved runs.

    Each steps the beginning of the move: short runs are more often left alone by what else the machine does.
    """
    motion, least = course.motion, np.full(len(scenes), np.inf)
    for _ in range(rounds):
        for k, scene in enumerate(scenes):
            run = march(scene, motion, STEPS * course.step, course.step, every=STEPS, angles=motion.angles)
            least[k] = min(least[k], run.seconds / run.steps)
    return least
