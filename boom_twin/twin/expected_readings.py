"""Expected readings and their standard deviations, kept for samples that arrive later than the stroke they belong to."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..analysis.modal import StrokeNoise, stroke_noise
from ..compiler.plan import Plan
from ..config.settings import Settings
from ..estimation.look_ahead import copy_state
from ..estimation.sensor_model import Mounting, specific_force
from ..kernels.elements.linkage import cylinder_length
from ..kernels.tables import State
from ..types import NANO, Array, Prediction, Stream

SPAN = 2_000_000_000  # ns


class Expected(NamedTuple):
    """What sensors should read at a stamp (ns) and with what deviations, by stream, shape (channels,); strokes (n,) m."""

    stamp: int
    values: dict[Stream, Array]
    sigmas: dict[Stream, Array]
    strokes: Array


class PredictionBuffer:
    """Expected readings by stamp, the last `SPAN` of them."""

    def __init__(self) -> None:
        self._past: deque[Expected] = deque()

    def add(self, expected: Expected) -> None:
        """Remember; stamps only grow."""
        self._past.append(expected)
        while self._past[0].stamp < expected.stamp - SPAN:
            self._past.popleft()

    def at(self, stamp: int) -> Expected | None:
        """Linear between the two predictions around `stamp`, with the deviations of the later one; None outside."""
        after: Expected | None = None
        for entry in reversed(self._past):
            if entry.stamp == stamp:
                return entry
            if entry.stamp < stamp:
                return None if after is None else _between(entry, after, stamp)
            after = entry
        return None


def _between(old: Expected, new: Expected, stamp: int) -> Expected:
    share = (stamp - old.stamp) / (new.stamp - old.stamp)
    values = {stream: value + share * (new.values[stream] - value) for stream, value in old.values.items()}
    return Expected(stamp, values, new.sigmas, old.strokes + share * (new.strokes - old.strokes))


POSTURE_STEP = 0.04  # m of stroke after which the noise is propagated anew
INTERVAL_STEP = 0.2  # of the time between samples, likewise
INTERVAL = 250_000_000  # ns between looks at whether it has, and evaluations of how the noise has grown


class Deviations:
    """Expected standard deviations of the residuals, following the posture.

    Parameters
    ----------
    plan : Plan
    settings : Settings
    epoch : int
        Stamp (ns) of the first one, when the boom was at rest.
    speeds : ndarray, shape (n,), or None
        Of the strokes (m/s) where the boom was at work when the model started at rest; None if it was at rest.

    Attributes
    ----------
    tip : ndarray, shape (2,)
        Deviation of the tip (m) by vibration that the model cannot know of: a start from rest while the boom was at work,
        what strokes did in a pause, a pause that may have been a clock. It decays with the modes' damping.
    noise : StrokeNoise or None
        As propagated last; None before the first prediction.
    """

    def __init__(self, plan: Plan, settings: Settings, epoch: int, speeds: Array | None = None) -> None:
        self._plan, self._settings, self._epoch = plan, settings, epoch
        self.noise: StrokeNoise | None = None
        self._interval, self._speeds, self.tip = 0.0, speeds, np.zeros(2)
        self._at = np.zeros(plan.joints)
        self._seen = epoch
        self._unknown, self._since = np.zeros(0), epoch
        self._slopes2 = np.zeros(plan.joints)
        self._joints = np.zeros(plan.joints)
        self._force = np.zeros(2)

    def at(self, prediction: Prediction, interval: float, variances: Array, live: State, angles: Array) -> tuple[Array, Array]:
        """Deviations of the joint angles (n,) in rad, and of the specific force (2,) in m/s^2.

        Parameters
        ----------
        interval : float
            Time between stroke samples, s.
        variances : ndarray, shape (n,)
            Of the strokes' newest estimates, m^2.
        live : State
            The boom as predicted; left as it is.
        angles : ndarray, shape (n,)
            Joint angles of the rigid boom, rad.
        """
        if self.noise is None or prediction.stamp >= self._seen + INTERVAL:
            self._refresh(prediction, interval, live, angles)
        return np.sqrt(self._joints + self._slopes2 * variances), self._force

    def rebase(self, shift: int) -> None:
        """All stamps are later by `shift` (ns) from now on."""
        self._epoch += shift
        self._seen += shift
        self._since += shift

    def add_pause(self, stamp: int, span: float, densities: Array) -> None:
        """Strokes were not measured for `span` s up to `stamp` (ns); see `StrokeNoise.of_pause`."""
        if self.noise is not None:
            self._add(stamp, self.noise.of_pause(self._plan, span, densities))

    def add_phase(self, stamp: int, prediction: Prediction) -> None:
        """How much time passed up to `stamp` (ns) is not known, while the boom vibrated as in `prediction`."""
        if self.noise is not None:
            self._add(stamp, self.noise.of_phase(self._plan, prediction.tip_velocity, prediction.tip_acceleration))

    def _add(self, stamp: int, variances: Array) -> None:
        """Vibration with these variances (modes,), from `stamp` on, that the model cannot know of."""
        self._unknown, self._since = self._left(stamp) + variances, stamp
        self._seen = stamp - INTERVAL

    def _left(self, stamp: int) -> Array:
        """What is left of the unknown vibration at `stamp`; of the modes at the present posture."""
        assert self.noise is not None
        found = np.zeros(len(self.noise.modes))
        count = min(len(found), len(self._unknown))
        found[:count] = self._unknown[:count]
        return found * np.exp(-self.noise.decay * max(0.0, (stamp - self._since) * NANO))

    def _refresh(self, prediction: Prediction, interval: float, live: State, angles: Array) -> None:
        self._seen = prediction.stamp
        moved = float(np.max(np.abs(prediction.strokes - self._at))) > POSTURE_STEP
        if self.noise is None or moved or abs(interval - self._interval) > INTERVAL_STEP * interval:
            self.noise = self._propagate(live, interval)
            self._at, self._interval = prediction.strokes, interval
            slopes = [cylinder_length(self._plan.tables.linkages[i], angle)[1] for i, angle in enumerate(angles)]
            self._slopes2 = 1.0 / np.square(slopes)
        if self._speeds is not None:
            self._add(self._epoch, self.noise.of_start(self._plan, self._speeds, prediction.tip_displacement))
            self._speeds, self._seen = None, prediction.stamp
        time = (prediction.stamp - self._epoch) * NANO
        joints, acceleration = self.noise.after(time, prediction.tip_angle)
        if len(self._unknown):
            more, swing, tip = self.noise.of(self._left(prediction.stamp), self._plan, prediction.tip_angle)
            joints, acceleration, self.tip = joints + more, acceleration + swing, np.sqrt(tip)
        self._joints = self._settings.angle_variance + joints
        self._force = np.sqrt(self._settings.imu_sigma**2 + acceleration)

    def _propagate(self, live: State, interval: float) -> StrokeNoise:
        probe, work = self._plan.state(), self._plan.work()
        copy_state(live, probe)
        tuned = self._settings
        return stroke_noise(self._plan, probe, work, tuned.stroke_variance, interval, tuned.jerk_density)


class PredictedBoom(NamedTuple):
    """The boom at one stamp, as expected readings need it.

    Attributes
    ----------
    prediction : Prediction
    live : State
        The model's state.
    gravity : ndarray, shape (2,)
        m/s^2.
    mounting : Mounting
        Of the angle sensors.
    settings : Settings
    joint_sigmas, force_sigmas : ndarray, shape (n,), (2,)
        See `Deviations.at`.
    """

    prediction: Prediction
    live: State
    gravity: Array
    mounting: Mounting
    settings: Settings
    joint_sigmas: Array
    force_sigmas: Array


def _angles(boom: PredictedBoom) -> tuple[Array, Array]:
    mounting = boom.mounting
    sigmas = mounting.deviations(boom.joint_sigmas, boom.settings.angle_variance)
    return mounting.expected(boom.prediction.joints, boom.live), sigmas


def _force(boom: PredictedBoom) -> tuple[Array, Array]:
    return tip_specific_force(boom.prediction, boom.gravity), boom.force_sigmas


READINGS: dict[Stream, Callable[[PredictedBoom], tuple[Array, Array]]] = {
    Stream.ANGLES: _angles,
    Stream.IMU: _force,
}
"""What the sensors of a stream should read, and the standard deviation of reading minus expected, SI, shape (channels,)."""


def expected_readings(boom: PredictedBoom, strokes: Array) -> Expected:
    """What all sensors should read, with the strokes (n,) in m as measured."""
    values: dict[Stream, Array] = {}
    sigmas: dict[Stream, Array] = {}
    for stream, reading in READINGS.items():
        values[stream], sigmas[stream] = reading(boom)
    return Expected(boom.prediction.stamp, values, sigmas, strokes)


def tip_specific_force(prediction: Prediction, gravity: Array) -> Array:
    """What an IMU at the tip feels along its x and z, shape (2,), m/s^2."""
    c, s = math.cos(prediction.tip_angle), math.sin(prediction.tip_angle)
    x, y = (prediction.tip_acceleration - gravity).tolist()
    return np.array(specific_force(x, y, c, s))
