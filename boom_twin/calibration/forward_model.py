"""Forward model of a calibration: residuals of sessions as a function of the unknowns, with derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..analysis.batch import Batch
from ..compiler.compile import compile_scene
from ..compiler.plan import taken_apart
from ..config.settings import Settings
from ..deviation.sensor_model import specific_force
from ..errors import BagError, SolverError
from ..kernels.result_row import Results
from ..scene.edit import with_parameters
from ..scene.kinematics import gravity_in_base, joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array, Stream, channels_of, sensor_kind, stream_of
from .noise_model import NoiseModel, ResidualBlocks
from .sessions import SessionCourse
from .unknowns import Unknown

Values = Mapping[str, float]


Readings = dict[Stream, Array]


def boom_of(scene: Scene, trial: Values) -> Scene:
    """Return the scene with parameter values (SI) by name; zeros of sensors are ignored."""
    return with_parameters(scene, {name: value for name, value in trial.items() if not name.endswith(".zero")})


def _specific_force(results: Results, gravity: Array) -> Array:
    felt, angle = results.tip[..., 2, :2] - gravity, results.tip[..., 0, 2]
    return np.stack(specific_force(felt[..., 0], felt[..., 1], np.cos(angle), np.sin(angle)), axis=-1)


READINGS: dict[Stream, Callable[[Results, Array], Array]] = {
    Stream.ANGLES: lambda results, gravity: results.joints,
    Stream.IMU: _specific_force,
}
"""Expected readings of the streams that a fit can compare, shape (.., channels), given gravity (m/s^2)."""


class ForwardModel:
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
        self._batch = Batch([compile_scene(boom_of(scene, trial)) for trial in trials])
        strokes = channels_of(len(scene.joints))[Stream.STROKES]
        self._zeros = np.array([[trial.get(f"{name}.zero", 0.0) for name in strokes] for trial in trials])

    def move(self, course: SessionCourse, noise: Array | None = None) -> Readings:
        """Return the readings along a course.

        Parameters
        ----------
        noise : ndarray, shape (trials, m, n), optional
            Added to the strokes, m.

        Returns
        -------
        dict of Stream to ndarray, shape (trials, m, channels)
            What the sensors of the streams of `READINGS` should read, SI.

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

    def rest(self, strokes: Array) -> Readings:
        """Return the readings at rest with strokes (n,) in m; shape (trials, 1, channels) for each stream."""
        return self._readings(self._settled(strokes, strokes - self._zeros)[:, None])

    def _settled(self, near: Array, strokes: Array) -> Array:
        return self._batch.settle(strokes, joint_angles_of_strokes(self._scene, near))

    def _readings(self, rows: Array) -> Readings:
        found = taken_apart(self._batch.plans[0], rows)
        return {stream: reading(found, self._gravity) for stream, reading in READINGS.items()}


DIFFERENCE = 1e-4  # of a prior deviation, for derivatives; swings fall out of step within a few thousandths
REALISATIONS = 48  # of the noise, over all sessions
START = 0.02  # prior deviations off a bound
PRESENT = 0.5  # share of blocks that a channel must have

Parts = Sequence[tuple[SessionCourse, ResidualBlocks]]


class CalibrationProblem:
    """Comparison of predicted with measured block means of all sessions, as a function of the unknowns.

    Parameters
    ----------
    scene : Scene
    unknowns : sequence of Unknown
    parts : sequence of (Course, Blocks)
        What of every session is used.
    channels : sequence of str
        Of the blocks.
    settings : Settings
        Noise of the sensors.

    Attributes
    ----------
    channels : tuple of str
        Those that all sessions have.
    deviations : ndarray, shape (c,)
        Of a single sample of each of them.
    length : float
        Of a block, s.
    stroke_variance : float
        Of a reading of the strokes, m^2.

    Raises
    ------
    BagError
        No channel has enough values.
    """

    def __init__(
        self, scene: Scene, unknowns: Sequence[Unknown], parts: Parts, channels: Sequence[str], settings: Settings
    ) -> None:
        self.scene, self.unknowns, self.parts = scene, tuple(unknowns), tuple(parts)
        present = np.all([np.isfinite(blocks.measured).mean(axis=0) > PRESENT for _, blocks in parts], axis=0)
        self.used = np.flatnonzero(present)
        if not len(self.used):
            raise BagError("no angle sensor has values throughout all sessions. Record strokes and joint angles together.")
        self.channels = tuple(channels[int(i)] for i in self.used)
        self.deviations = np.sqrt([settings.variance(sensor_kind(name)) for name in self.channels])
        self._direct = [self._effect(unknown) for unknown in unknowns]
        self.length = float(np.diff(parts[0][1].times[:2])[0])
        self.stroke_variance = settings.stroke_variance

    @property
    def least(self) -> Array:
        """Return the lower bounds of the deviations."""
        return np.array([unknown.least for unknown in self.unknowns])

    @property
    def start(self) -> Array:
        """Return the deviations of the present values; a load that is not there begins a little off its bound."""
        return np.maximum(0.0, self.least + START)

    def values(self, deviations: Array) -> dict[str, float]:
        """Return the values of the unknowns by name."""
        return {unknown.name: unknown.value(float(d)) for unknown, d in zip(self.unknowns, deviations, strict=True)}

    def moving(self, deviations: Array, whitening: NoiseModel) -> tuple[Array, Array]:
        """Return the white residuals of all sessions, shape (k,), and their derivatives, shape (k, p)."""
        forward = ForwardModel(self.scene, self.trials(deviations))
        residuals, slopes = [], []
        for course, blocks in self.parts:
            means = blocks.averaged(forward.move(course))
            predicted, slope = self.with_slopes(means, deviations)
            left = blocks.measured[:, self.used] - predicted
            gaps = np.where(np.isfinite(left), 0.0, np.nan)
            residuals.append(whitening(left).ravel())
            slopes.append(-whitening(slope + gaps).reshape(len(self.unknowns), -1))
        return np.concatenate(residuals), np.concatenate(slopes, axis=1).T

    def resting(self, deviations: Array, strokes: Array) -> tuple[Array, Array]:
        """Return the readings (k, c) at rest with strokes (k, n) in m, and their derivatives (p, k, c)."""
        forward = ForwardModel(self.scene, self.trials(deviations))
        streams = self.parts[0][1].means
        rows = [np.concatenate([readings[stream] for stream in streams], axis=2) for readings in map(forward.rest, strokes)]
        return self.with_slopes(np.concatenate(rows, axis=1), deviations)

    def noise(self, deviations: Array) -> list[Array]:
        """Return realisations of the noise of block means, one array (k, b, c) for every session.

        The strokes' noise excites the natural modes, so it depends on the unknowns.
        """
        rng = np.random.default_rng(0)
        count = -(-REALISATIONS // len(self.parts))
        forward = ForwardModel(self.scene, [self.values(deviations)] * (count + 1))
        found = []
        for course, blocks in self.parts:
            noise = np.zeros((len(course.stamps), count + 1, course.strokes.shape[1]))
            noise[:, 1:] = np.sqrt(self.stroke_variance) * rng.standard_normal(noise[:, 1:].shape)
            readings = forward.move(course, course.smoothed(noise).swapaxes(0, 1))
            means = blocks.averaged(readings)[..., self.used]
            own = self.deviations / np.sqrt(np.maximum(blocks.counts[:, self.used], 1.0))
            found.append(means[1:] - means[0] + own * rng.standard_normal(means[1:].shape))
        return found

    def booms(self, deviations: Array, step: float) -> dict[int | None, Scene]:
        """Return the boom itself, by None, and the booms with one of its unknowns moved by `step`, by number."""
        moved: list[int | None] = [i for i, unknown in enumerate(self.unknowns) if unknown.channel is None]
        every = np.arange(len(deviations))
        return {i: boom_of(self.scene, self.values(deviations + step * (every == i))) for i in [None, *moved]}

    def trials(self, deviations: Array) -> list[dict[str, float]]:
        """Return the values, and the values with each unknown moved that acts through the boom."""
        moved = [deviations]
        for i, direct in enumerate(self._direct):
            if direct is None:
                moved.append(deviations.copy())
                moved[-1][i] += DIFFERENCE
        return [self.values(each) for each in moved]

    def with_slopes(self, readings: Array, deviations: Array) -> tuple[Array, Array]:
        """Return the used channels (b, c) of readings (trials, b, channels), and their derivatives (p, b, c)."""
        readings = readings[..., self.used]
        acting = iter((readings[1:] - readings[0]) / DIFFERENCE)
        slopes = np.array([next(acting) if d is None else np.broadcast_to(d, readings[0].shape) for d in self._direct])
        return readings[0] + self._zeros(deviations), slopes

    def left(self, deviations: Array, course: SessionCourse, blocks: ResidualBlocks) -> Array:
        """Return measured minus predicted means (b, c) of one session."""
        readings = blocks.averaged(ForwardModel(self.scene, [self.values(deviations)]).move(course))[0]
        return np.asarray((blocks.measured - readings)[:, self.used] - self._zeros(deviations))

    def _zeros(self, deviations: Array) -> Array:
        """Return the contribution of the compared sensors' zeros to each channel, (c,)."""
        pairs = zip(self._direct, deviations, strict=True)
        return sum((effect * at for effect, at in pairs if effect is not None), np.zeros(len(self.used)))

    def _effect(self, unknown: Unknown) -> Array | None:
        """Return the contribution of a prior deviation to each channel (c,); None if not a zero of a compared sensor."""
        if unknown.channel is None or stream_of(unknown.channel) is Stream.STROKES:
            return None
        return unknown.kind.prior * np.array([channel == unknown.channel for channel in self.channels], dtype=float)
