"""Expected readings of all sensors, and their standard deviations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..analysis.modal import StrokeNoise, StrokeSpectrum, stroke_noise_of
from ..compiler.plan import Plan
from ..config.settings import Settings
from ..estimation.posture_modes import Posture, PostureModes
from ..estimation.sensor_model import specific_force
from ..estimation.stroke_filter import corners
from ..kernels.elements.linkage import levers
from ..kernels.jit import inner
from ..kernels.tables import FRAME_ANGLE, State
from ..types import NANO, SENSORS, Array, Prediction, Stream
from .blocks import CODES
from .state import NONE, SEEN, TwinState

SPAN = 2_000_000_000  # ns
TINY = 1e-300


POSTURE_STEP = 0.04  # m of stroke after which the noise is propagated anew
INTERVAL_STEP = 0.2  # of the time between samples, likewise
NOISE_STEP = 1.5  # factor on what a mode collects after which others are told
INTERVAL = 250_000_000  # ns between looks at whether it has, and evaluations of how the noise has grown


class Deviations:
    """Expected standard deviations of the residuals, following the posture and how the strokes are filtered.

    Parameters
    ----------
    plan : Plan
    settings : Settings
    postures : PostureModes
        Of the boom that is planned.
    state : TwinState
        Where the deviations are kept.
    epoch : int
        Stamp (ns) of the first one, when the boom was at rest.
    speeds : ndarray, shape (n,), or None
        Of the strokes (m/s) where the boom was at work when the model started at rest; None if it was at rest.

    Attributes
    ----------
    tip : ndarray, shape (2,)
        Deviation of the tip (m) by vibration that the model cannot know of: what the strokes' noise has shaken, a start from
        rest while the boom was at work, what strokes did in a pause, a pause that may have been a clock. It decays with the
        modes' damping.
    noise : StrokeNoise or None
        As propagated last; None before the first prediction.
    """

    def __init__(
        self,
        plan: Plan,
        settings: Settings,
        postures: PostureModes,
        state: TwinState,
        epoch: int,
        speeds: Array | None = None,
    ) -> None:
        self._postures = postures
        self._plan, self._settings, self._epoch, self._state = plan, settings, epoch, state
        self.noise: StrokeNoise | None = None
        self._interval, self._speeds, self.tip = 0.0, speeds, np.zeros(2)
        self._at = np.zeros(plan.joints)
        self._unknown, self._since = np.zeros(0), epoch
        self._shaken, self._until = np.zeros(0), epoch
        state.clock[SEEN] = NONE

    def rebase(self, shift: int) -> None:
        """All stamps are later by `shift` (ns) from now on."""
        self._epoch += shift
        self._since += shift
        self._until += shift
        self._state.clock[SEEN] += shift

    def add_pause(self, stamp: int, span: float, densities: Array) -> None:
        """Strokes were not measured for `span` s up to `stamp` (ns); see `StrokeNoise.of_pause`."""
        if self.noise is not None:
            self._add(stamp, self.noise.of_pause(span, densities))

    def add_phase(self, stamp: int, prediction: Prediction) -> None:
        """How much time passed up to `stamp` (ns) is not known, while the boom vibrated as in `prediction`."""
        if self.noise is not None:
            self._add(stamp, self.noise.of_phase(prediction.tip_velocity, prediction.tip_acceleration))

    def _add(self, stamp: int, variances: Array) -> None:
        """Vibration with these variances (modes,), from `stamp` on, that the model cannot know of."""
        self._unknown, self._since = self._left(stamp) + variances, stamp
        self._state.clock[SEEN] = stamp - INTERVAL

    def _left(self, stamp: int) -> Array:
        """What is left of the unknown vibration at `stamp`; of the modes at the present posture."""
        return self._of_modes(self._unknown) * self._decayed(stamp - self._since)

    def _of_modes(self, variances: Array) -> Array:
        """Variances of modes as many as there are at the present posture."""
        assert self.noise is not None
        count = len(self.noise.modes)
        if len(variances) == count:
            return variances
        found = np.zeros(count)
        found[: len(variances)] = variances[:count]
        return found

    def _decayed(self, span: int) -> Array:
        """What the modes' damping leaves of variances after `span` ns, shape (modes,)."""
        assert self.noise is not None
        return np.asarray(np.exp(-self.noise.decay * max(0.0, span * NANO)))

    def refresh(
        self, prediction: Prediction, interval: float, filtered: tuple[Array, Array], live: State, angles: Array
    ) -> None:
        """Follow the posture: what is expected of joint angles, specific force and cylinder forces goes into the state.

        Parameters
        ----------
        prediction : Prediction
            The newest one.
        interval : float
            Time between stroke samples, s.
        filtered : two ndarray, shape (n, m), (n,)
            Since this was called last, see `boom_twin.estimation.boom_predictor.BoomPredictor.take_filtered`.
        live : State
            The boom as predicted; left as it is.
        angles : ndarray, shape (n,)
            Joint angles of the rigid boom, rad.
        """
        self._state.clock[SEEN] = prediction.stamp
        moved = float(np.abs(prediction.strokes - self._at).max()) > POSTURE_STEP
        spectrum = self._spectrum(interval, *filtered)
        if self.noise is None or moved or abs(interval - self._interval) > INTERVAL_STEP * interval:
            posture = self._postures.at(prediction.strokes, angles, live)
            self.noise = self._propagate(posture, spectrum)
            self._at, self._interval = posture.strokes, interval
            slopes = np.empty_like(angles)
            levers(self._plan.tables.linkages, angles, slopes)
            self._state.slopes2[:] = 1.0 / np.square(slopes)
        if self._speeds is not None:
            self._add(self._epoch, self.noise.of_start(self._speeds, prediction.tip_displacement))
            self._speeds, self._state.clock[SEEN] = None, prediction.stamp
        variances = self._shake(spectrum, prediction.stamp) + self._left(prediction.stamp)
        joints, acceleration, forces, tip = self.noise.of(variances, prediction.tip_angle)
        self.tip = np.sqrt(tip)
        self._state.joints2[:] = self._settings.angle_variance + joints
        self._state.accelerations2[:] = self._settings.imu_sigma**2 + acceleration
        self._state.pushes2[:] = self.noise.pushes(prediction.tip_angle)
        self._state.forces2[:] = self._settings.variance(SENSORS[Stream.FORCES]) + forces

    def _spectrum(self, interval: float, shares: Array, excess: Array) -> StrokeSpectrum:
        variance = self._settings.stroke_variance
        return StrokeSpectrum(variance, interval, corners(variance, interval, self._settings.stroke_agility), shares, excess)

    def _propagate(self, posture: Posture, spectrum: StrokeSpectrum) -> StrokeNoise:
        modes = posture.lowest(len(self._plan.names), float(spectrum.corners[-1]))
        return stroke_noise_of(self._plan, [(each.mode, each.damping, each.turns) for each in modes], spectrum)

    def _shake(self, spectrum: StrokeSpectrum, stamp: int) -> Array:
        """Variances (modes,) that noise with this spectrum since the last call, and the noise before, have collected."""
        assert self.noise is not None
        collected, left = self.noise.collected_of(spectrum), self._decayed(stamp - self._until)
        self._shaken, self._until = left * self._of_modes(self._shaken) + (1.0 - left) * collected, stamp
        if (np.abs(np.log((collected + TINY) / (self.noise.collected + TINY))) > np.log(NOISE_STEP)).any():
            self.noise = replace(self.noise, collected=collected)
        return self._shaken


ANGLES, IMU, FORCES = CODES[Stream.ANGLES], CODES[Stream.IMU], CODES[Stream.FORCES]


@inner
def write_expected(limits, state, live, results, estimates, values, sigmas):
    """Write what all sensors should read of the newest prediction, and the standard deviations of reading less that.

    Parameters
    ----------
    limits, state : Limits, TwinState
    live : State
        The boom as predicted.
    results, estimates : Results, Estimates
        See `boom_twin.kernels.result_row`.
    values, sigmas : ndarray, shape (measured channels,)
        In the order of the streams: angles (rad), then the tip IMU's x and z (m/s^2), then the cylinders' forces (N).
    """
    write_angles(limits, state, live, results, estimates, values, sigmas)
    write_specific_force(limits, state, results, estimates, values, sigmas)
    write_cylinder_forces(limits, state, results, values, sigmas)


@inner
def write_angles(limits, state, live, results, estimates, values, sigmas):
    """Of the joints' encoders, and of inclinometers, see `boom_twin.estimation.sensor_model.Mounting`.

    What stroke noise does to the joints inboard of an inclinometer is added up as if all of it came from one mode, which is the
    most that it can be; the sensor's own noise counts once.
    """
    shaken = 0.0
    for i in range(results.joints.shape[0]):
        values[i] = results.joints[i]
        sigmas[i] = math.sqrt(state.joints2[i] + state.slopes2[i] * estimates.variances[i])
        if limits.is_mounted:
            shaken += math.sqrt(max(sigmas[i] * sigmas[i] - limits.angle_variance, 0.0))
            if limits.absolute[i]:
                values[i] = live.frames[limits.frames[i], FRAME_ANGLE] + limits.inclination
                sigmas[i] = math.sqrt(limits.angle_variance + shaken * shaken)


@inner
def write_specific_force(limits, state, results, estimates, values, sigmas):
    """Of an IMU at the tip, along its x and z."""
    at, angle = limits.first[IMU], results.tip[0, 2]
    x, y = results.tip[2, 0] - limits.gravity[0], results.tip[2, 1] - limits.gravity[1]
    values[at], values[at + 1] = specific_force(x, y, math.cos(angle), math.sin(angle))
    for axis in range(2):
        variance = state.accelerations2[axis]
        for i in range(state.pushes2.shape[0]):
            variance += state.pushes2[i, axis] * estimates.variances[i]
        sigmas[at + axis] = math.sqrt(variance)


@inner
def write_cylinder_forces(limits, state, results, values, sigmas):
    """Between barrel and rod, positive in tension."""
    at = limits.first[FORCES]
    for i in range(results.cylinder_forces.shape[0]):
        values[at + i], sigmas[at + i] = results.cylinder_forces[i], math.sqrt(state.forces2[i])


def tip_specific_force(acceleration: Array, angle: Array, gravity: Array) -> Array:
    """What an IMU at the tip feels along its x and z, shape (k, 2), m/s^2.

    Parameters
    ----------
    acceleration, angle : ndarray, shape (k, 2), (k,)
        Of the tip, m/s^2 and rad.
    gravity : ndarray, shape (2,)
    """
    x, y = (acceleration - gravity).T
    return np.stack(specific_force(x, y, np.cos(angle), np.sin(angle)), axis=1)
