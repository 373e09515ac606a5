"""Innovations of all rest periods as a function of the unknowns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar

from ..deviation.channels import IMU_ZERO
from ..deviation.kalman import ANGLE_ZERO
from ..deviation.predictor import BoomPredictor
from ..scene.edit import with_parameters
from ..scene.kinematics import gravity_in_base
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..system.processes import usable_cores
from ..types import SENSORS, Array, channels_of
from .rest_filter import filter_rest
from .rest_periods import STREAMS, RestPeriod, Rigging, channel_names
from .unknowns import Unknown

DIFFERENCE = 3e-3  # of a prior's deviation, of derivatives
BLOCK = 2.0  # s of a block of readings, which are taken to depend on each other
LOADS, USUAL = (1e-5, 0.3), 2.5e-3  # shares of the boom's weight, between which the load's size is looked for; at first
EXACT = 0.15  # of the logarithm of that size


@dataclass(frozen=True)
class Noise:
    """Variances of the fast load in each rest period along x and y, (k, 2), N^2, and of the channels' noise (c,), SI."""

    loads: Array
    channels: Array


class RestingBoom:
    """Boom of one trial of the unknowns, and its filter in a rest period; `zeros` (c,) are those of the channels, SI."""

    def __init__(self, scene: Scene, zeros: Array, rigging: Rigging, gravity: Array) -> None:
        self._boom = BoomPredictor(scene, rigging.settings, rigging.mounts, rigging.reads, rigging.places)
        self._zeros, self._gravity, self._inclination = zeros, gravity, scene.base.inclination

    def rest(self, period: RestPeriod) -> None:
        """Put the boom to rest where it stands in a period."""
        self._boom.start(period.strokes - self._zeros[: self._boom.plan.joints])
        self._readings = period.times, period.channels, period.values - self._zeros[period.channels]

    def filtered(self, loads: Array, sensors: Array, zero2: Array) -> tuple[Array, Array]:
        """Return innovations of that period with their variances, (r, 2), and the zeros at its end; see `filter_rest`.

        `loads` (2,) and `sensors` (c,) are variances of the fast load and of the sensors' noise.
        """
        found, zeros = np.empty((len(self._readings[0]), 2)), np.empty(len(zero2))
        own = self._boom.posture, self._boom.filters
        filter_rest(*own, loads, zero2, self._gravity, self._inclination, *self._readings, sensors, found, zeros)
        return found, zeros


class CalibrationProblem:
    """Innovations of all rest periods as a function of the unknowns.

    Unknowns are counted in standard deviations of their priors, from the present values (`Unknown.value`). `channels` (r,)
    has the channel of each reading, `blocks` (r,) ascending numbers of blocks of `BLOCK` s.
    """

    def __init__(self, scene: Scene, unknowns: Sequence[Unknown], periods: Sequence[RestPeriod], rigging: Rigging) -> None:
        self.scene, self.unknowns, self._periods, self._rigging = scene, unknowns, periods, rigging
        self.names = channel_names(len(scene.joints))
        self.channels = np.concatenate([period.channels for period in periods])
        spans = [np.floor(period.times / BLOCK) + 1e6 * k for k, period in enumerate(periods)]
        self.blocks = np.unique(np.concatenate(spans), return_inverse=True)[1]
        joints, zeroed = len(scene.joints), {unknown.channel: unknown.kind.prior for unknown in unknowns}
        self._zeroed = (*self.names[2 * joints : 2 * joints + 2], *self.names[joints : 2 * joints])
        self._prior2 = np.array([zeroed.get(name, 0.0) ** 2 for name in self._zeroed])
        axes2 = [0.0 if name in zeroed else IMU_ZERO**2 for name in self._zeroed[:2]]
        self._zero2 = np.array(axes2 + joints * [ANGLE_ZERO**2])  # of angles: the error of the model's statics
        self._gravity, self._weight = gravity_in_base(scene), weight_of(scene)

    @property
    def least(self) -> Array:
        """Lower bounds of the deviations, shape (p,)."""
        return np.array([unknown.least for unknown in self.unknowns])

    def sensor_noise(self) -> Array:
        """Return the variances that the settings state, by channel."""
        widths = [len(channels_of(len(self.scene.joints))[stream]) for stream in STREAMS]
        return np.repeat([self._rigging.settings.variance(SENSORS[stream]) for stream in STREAMS], widths)

    def start(self) -> Array:
        """Return the deviations to start from: zeros of angle sensors and IMU that rest periods show one by one, shape (p,)."""
        usual = Noise(np.full((len(self._periods), 2), (USUAL * self._weight) ** 2), self.sensor_noise())
        boom, seen = self.boom_at({}), []
        for period, loads in zip(self._periods, usual.loads, strict=True):
            boom.rest(period)
            seen.append(boom.filtered(loads, usual.channels, self._zero2 + self._prior2)[1])
        zeros = dict(zip(self._zeroed, np.mean(seen, axis=0).tolist(), strict=True))
        return np.array([zeros.get(unknown.channel or "", 0.0) / unknown.kind.prior for unknown in self.unknowns])

    def values(self, deviations: Array) -> dict[str, float]:
        """Return the unknowns by name, SI."""
        return {unknown.name: unknown.value(at) for unknown, at in zip(self.unknowns, deviations.tolist(), strict=True)}

    def innovations(self, trials: Iterable[dict[str, float]], noise: Noise) -> list[Array]:
        """Return innovations and their variances, (r, 2), of several trials of parameters and zeros (SI, by name)."""

        def of(trial: dict[str, float]) -> Array:
            boom, found = self.boom_at(trial), []
            for period, loads in zip(self._periods, noise.loads, strict=True):
                boom.rest(period)
                found.append(boom.filtered(loads, noise.channels, self._zero2)[0])
            return np.concatenate(found)

        with ThreadPoolExecutor(usable_cores()) as pool:
            return list(pool.map(of, trials))

    def boom_at(self, trial: dict[str, float]) -> RestingBoom:
        """Return the boom with the parameters of a trial, whose sensors read too much by its zeros."""
        scene = with_parameters(self.scene, {name: value for name, value in trial.items() if not name.endswith(".zero")})
        zeros = np.array([trial.get(f"{name}.zero", 0.0) for name in self.names])
        return RestingBoom(scene, zeros, self._rigging, self._gravity)

    def noise(self, deviations: Array, sensors: Array) -> Noise:
        """Return the noise with the load of each rest period at its greatest likelihood; `sensors` (c,) is kept."""
        trial, bounds = self.values(deviations), np.log(np.array(LOADS) * self._weight)

        def most_likely(period: RestPeriod) -> Array:
            boom = self.boom_at(trial)
            boom.rest(period)

            def cost(sizes: Array) -> float:
                return likelihood_cost(boom.filtered(np.exp(2.0 * sizes), sensors, self._zero2)[0])

            exact = {"xatol": EXACT}
            both = minimize_scalar(lambda size: cost(np.full(2, size)), bounds=bounds, method="bounded", options=exact).x
            options = exact | {"fatol": 0.5, "initial_simplex": both + np.array([[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0]])}
            found = minimize(cost, np.full(2, both), method="Nelder-Mead", bounds=[tuple(bounds)] * 2, options=options).x
            return np.asarray(np.exp(2.0 * found))

        with ThreadPoolExecutor(usable_cores()) as pool:
            return Noise(np.array(list(pool.map(most_likely, self._periods))), sensors)

    def slopes(self, deviations: Array, noise: Noise, base: Array) -> Array:
        """Return derivatives of innovations and variances by the unknowns, (p, r, 2); `base` is at `deviations`."""
        steps = DIFFERENCE * np.eye(len(deviations))
        trials = (self.values(deviations + step) for step in steps)
        return np.array([(found - base) / DIFFERENCE for found in self.innovations(trials, noise)])

    def slopes_by_model(self, deviations: Array, assumed: Sequence[Unknown], noise: Noise, base: Array) -> Array:
        """Return the same by parameters that are taken to be known, in the deviations that they may be wrong by."""
        own = self.values(deviations)
        trials = (own | {each.name: each.value(DIFFERENCE)} for each in assumed)
        return np.array([(found - base) / DIFFERENCE for found in self.innovations(trials, noise)]).reshape(-1, *base.shape)


def likelihood_cost(found: Array) -> float:
    """Return the negative log likelihood of innovations and variances (r, 2), up to a constant."""
    return float(0.5 * np.sum(found[:, 0] ** 2 / found[:, 1] + np.log(found[:, 1])))
