"""Deviation and cost of a reduced model: how far its tip is from the full model's, and what a step takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..analysis.equilibrium import settle
from ..analysis.methods import DURATION, Motion, integrate_with, motion_of
from ..analysis.modal import natural_modes
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..errors import SolverError
from ..scene.kinematics import posture_angles, strokes_of_posture
from ..scene.schema import Scene
from ..types import Array

FREQUENCIES = 3


@dataclass(frozen=True)
class StrokeCourse:
    """Course on which all models are compared: strokes at rest and a move."""

    names: tuple[str, ...]  # the postures, m of them, then "start of the move"
    strokes: Array  # (m + 1, n), strokes, m
    angles: Array  # (m + 1, n), joint angles of the undeformed boom there, rad
    motion: Motion
    step: float = 1e-3  # s; the tip is compared after every `every` of them
    every: int = 4


@dataclass(frozen=True)
class Response:
    """Response of a model on a course."""

    rest: Array  # (m + 1, 2), tip at rest, m
    frequencies: Array  # (up to `FREQUENCIES`,), Hz, at rest at the start of the move; empty if not asked for
    tip: Array  # (rows, 2), tip in the move, m
    seconds: float  # CPU time of stepping the move
    status: str  # "ok", or the sentence that says why there are no numbers


@dataclass(frozen=True)
class Deviation:
    """Distances of two models' tips, m: the largest at rest and where, rms and largest in the move. Infinite on failure."""

    rest: float
    where: str
    rms: float
    most: float

    @property
    def worst(self) -> float:
        """The largest of all, m."""
        return max(self.rest, self.most)


def course_of(scene: Scene, posture: str | None = None, duration: float = DURATION) -> StrokeCourse:
    """All postures of a scene, and its `motion_of` from `posture` for `duration` (s)."""
    motion = motion_of(scene, posture, duration)
    names = tuple(scene.postures)
    strokes = [*(strokes_of_posture(scene, name) for name in names), motion.first]
    angles = [*(posture_angles(scene, name) for name in names), motion.angles]
    places = (*(f"posture {name}" for name in names), "the start of the move")
    return StrokeCourse(places, np.array(strokes), np.array(angles), motion)


def answer(scene: Scene, course: StrokeCourse, frequencies: int = 0) -> Response:
    """Take a model through a course; a failure is a status, not an error."""
    try:
        plan = compile_scene(scene)
        rest, found = _at_rest(plan, course, frequencies)
        moved = integrate_with(
            scene, course.motion, course.motion.duration, course.step, course.every, angles=course.motion.angles
        )
    except SolverError as error:
        nothing = np.zeros((0, 2))
        return Response(nothing, np.zeros(0), nothing, np.nan, str(error))
    return Response(rest, found, moved.tip, moved.seconds, moved.status)


def _at_rest(plan: Plan, course: StrokeCourse, frequencies: int) -> tuple[Array, Array]:
    """Tips at rest (m + 1, 2), and frequencies (Hz) about the last of them."""
    state, work = plan.state(), plan.work()
    tips = np.empty((len(course.names), 2))
    for k, (strokes, angles) in enumerate(zip(course.strokes, course.angles, strict=True)):
        settle(plan, state, work, strokes, angles)
        tips[k] = state.frames[-1, :2]
    modes = natural_modes(plan, state, work, frequencies, 1e-7)
    return tips, np.array([mode.frequency for mode in modes])


def deviation(model: Response, full: Response, course: StrokeCourse) -> Deviation:
    """Return the deviation of a model from the full one."""
    if model.status != "ok":
        return Deviation(np.inf, "", np.inf, np.inf)
    rest = np.linalg.norm(model.rest - full.rest, axis=1)
    move = np.linalg.norm(model.tip - full.tip, axis=1)
    worst = int(np.argmax(rest))
    return Deviation(float(rest[worst]), course.names[worst], float(np.sqrt(np.mean(move**2))), float(move.max()))


# In unknowns, measured on the default boom:
AXIAL = 0.35  # an axial coordinate; other unknowns count as one

STEPS = 400  # that are timed


def unknowns(scene: Scene) -> int:
    """Unknowns of one step."""
    return len(compile_scene(scene).names)


def size(scene: Scene) -> float:
    """Cost of a step, counted in unknowns: the same on every machine and at any load, so that choices can be made by it."""
    coordinate_cost = 0.05  # a coordinate of a mass, or a point that turns finitely
    plan = compile_scene(scene)
    unknowns, beams = len(plan.names), plan.tables.beams
    shares = len(plan.masses) - unknowns + beams.finite.sum()
    return float(unknowns - (1.0 - AXIAL) * beams.axial.sum() + coordinate_cost * shares)


def step_times(scenes: Sequence[Scene], course: StrokeCourse, rounds: int) -> Array:
    """Time (s) of a step of every scene, shape (scenes,): the least of `rounds` interleaved runs.

    Each steps the beginning of the move: short runs are more often left alone by what else the machine does.
    """
    motion, least = course.motion, np.full(len(scenes), np.inf)
    for _ in range(rounds):
        for k, scene in enumerate(scenes):
            run = integrate_with(scene, motion, STEPS * course.step, course.step, every=STEPS, angles=motion.angles)
            least[k] = min(least[k], run.seconds / run.steps)
    return least
