"""What the model says that the sensors should read, for many values of the unknowns at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..analysis.batch import Batch
from ..analysis.rows import taken_apart
from ..errors import SolverError
from ..plan.compile import compile_scene
from ..records import Array, Stream, channels_of
from ..scene.kinematics import gravity_in_base, joint_angles_of_strokes
from ..scene.named import with_parameters
from ..scene.parts import Scene
from .course import Course

Values = Mapping[str, float]


class Forward:
    """Predictions of a boom for trials of its parameters and of the zeros of its stroke transducers.

    Parameters
    ----------
    scene : Scene
        As it is at present.
    trials : sequence of dict
        Value (SI) by name of the unknowns; zeros of other sensors are passed over.
    """

    def __init__(self, scene: Scene, trials: Sequence[Values]) -> None:
        self._scene, self._gravity = scene, gravity_in_base(scene)
        own = [{name: value for name, value in trial.items() if not name.endswith(".zero")} for trial in trials]
        self._batch = Batch([compile_scene(with_parameters(scene, values)) for values in own])
        strokes = channels_of(len(scene.joints))[Stream.STROKES]
        self._zeros = np.array([[trial.get(f"{name}.zero", 0.0) for name in strokes] for trial in trials])

    def move(self, course: Course, noise: Array | None = None) -> tuple[Array, Array]:
        """Readings along a course.

        Parameters
        ----------
        noise : ndarray, shape (trials, m, n), optional
            Added to the strokes, m.

        Returns
        -------
        angles : ndarray, shape (trials, m, n)
        force : ndarray, shape (trials, m, 2)
            Specific force of the tip.

        Raises
        ------
        SolverError
            The model fails with one of the trials.
        """
        strokes = course.strokes - self._zeros[:, None]
        if noise is not None:
            strokes = strokes + noise
        rates = np.gradient(strokes, course.step, axis=1)
        first = self._settled(course.strokes[0], strokes[:, 0])
        rows = self._batch.run(course.step, strokes[:, 1:], rates[:, 1:])
        if failures := self._batch.failures():
            raise SolverError(f"the model fails within the session: {next(iter(failures.values()))}. Is it one of this boom?")
        return self._readings(np.concatenate([first[:, None], rows], axis=1))

    def rest(self, strokes: Array) -> tuple[Array, Array]:
        """Readings at rest with strokes (n,) in m; shapes (trials, 1, n) and (trials, 1, 2)."""
        return self._readings(self._settled(strokes, strokes - self._zeros)[:, None])

    def _settled(self, near: Array, strokes: Array) -> Array:
        return self._batch.settle(strokes, joint_angles_of_strokes(self._scene, near))

    def _readings(self, rows: Array) -> tuple[Array, Array]:
        found = taken_apart(self._batch.plans[0], rows.reshape(-1, rows.shape[-1]))
        force = _specific_force(found.tip[:, 2, :2] - self._gravity, found.tip[:, 0, 2])
        return found.joints.reshape(*rows.shape[:2], -1), force.reshape(*rows.shape[:2], 2)


def _specific_force(felt: Array, angle: Array) -> Array:
    """Acceleration less gravity (k, 2) in axes turned by `angle` (k,)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * felt[:, 0] + s * felt[:, 1], c * felt[:, 1] - s * felt[:, 0]])
