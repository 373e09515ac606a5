"""How far a model's tip is from the full model's: at rest in the scene's postures, and in a move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.frequencies import natural_modes
from ..analysis.march import march
from ..analysis.statics import settle
from ..errors import SolverError
from ..plan.compile import compile_scene
from ..plan.plan import Plan
from ..records import Array
from ..scene.kinematics import posture_angles, strokes_of_posture
from ..scene.parts import Scene
from .motion import DURATION, Motion, motion_of

STEP = 1e-3  # s
EVERY = 4
FREQUENCIES = 3
WIDTH = 1e-7  # relative, of a frequency's bracket


@dataclass(frozen=True)
class Course:
    """Where models are compared: strokes at rest and a move, the same for all.

    Attributes
    ----------
    names : tuple of str
        The postures, m of them, then "start of the move".
    strokes, angles : ndarray, shape (m + 1, n)
        Strokes (m), and joint angles (rad) of the undeformed boom there.
    motion : Motion
    step : float
        s; the tip is compared after every `every` of them.
    """

    names: tuple[str, ...]
    strokes: Array
    angles: Array
    motion: Motion
    step: float = STEP
    every: int = EVERY


@dataclass(frozen=True)
class Answer:
    """What a model says on a course.

    Attributes
    ----------
    rest : ndarray, shape (m + 1, 2)
        Tip at rest, m.
    frequencies : ndarray, shape (up to `FREQUENCIES`,)
        Hz, about the rest at the start of the move; empty if they were not asked for.
    tip : ndarray, shape (rows, 2)
        Tip in the move, m.
    seconds : float
        Stepping of the move alone.
    status : str
        "ok", or the sentence that says why there are no numbers.
    """

    rest: Array
    frequencies: Array
    tip: Array
    seconds: float
    status: str


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


def course_of(scene: Scene, posture: str | None = None, duration: float = DURATION) -> Course:
    """All postures of a scene, and its `motion_of` from `posture` for `duration` (s)."""
    motion = motion_of(scene, posture, duration)
    names = tuple(scene.postures)
    strokes = [*(strokes_of_posture(scene, name) for name in names), motion.first]
    angles = [*(posture_angles(scene, name) for name in names), motion.angles]
    places = (*(f"posture {name}" for name in names), "the start of the move")
    return Course(places, np.array(strokes), np.array(angles), motion)


def answer(scene: Scene, course: Course, frequencies: int = 0) -> Answer:
    """Take a model through a course; a failure is a status, not an error."""
    try:
        plan = compile_scene(scene)
        rest, found = _at_rest(plan, course, frequencies)
        moved = march(scene, course.motion, course.motion.duration, course.step, course.every, angles=course.motion.angles)
    except SolverError as error:
        nothing = np.zeros((0, 2))
        return Answer(nothing, np.zeros(0), nothing, np.nan, str(error))
    return Answer(rest, found, moved.tip, moved.seconds, moved.status)


def _at_rest(plan: Plan, course: Course, frequencies: int) -> tuple[Array, Array]:
    """Tips at rest (m + 1, 2), and frequencies (Hz) about the last of them."""
    state, work = plan.state(), plan.work()
    tips = np.empty((len(course.names), 2))
    for k, (strokes, angles) in enumerate(zip(course.strokes, course.angles, strict=True)):
        settle(plan, state, work, strokes, angles)
        tips[k] = state.frames[-1, :2]
    modes = natural_modes(plan, state, work, frequencies, WIDTH)
    return tips, np.array([mode.frequency for mode in modes])


def deviation(model: Answer, full: Answer, course: Course) -> Deviation:
    """Of a model from the full one."""
    if model.status != "ok":
        return Deviation(np.inf, "", np.inf, np.inf)
    rest = np.linalg.norm(model.rest - full.rest, axis=1)
    move = np.linalg.norm(model.tip - full.tip, axis=1)
    worst = int(np.argmax(rest))
    return Deviation(float(rest[worst]), course.names[worst], float(np.sqrt(np.mean(move**2))), float(move.max()))
