"""Innovations of all rest periods as a function of the unknowns, the maximum-likelihood estimate, and undetermined unknowns.

The innovations e of a Kalman filter with variances S have the log likelihood -sum (e^2 / S + log S) / 2. Scoring (Gauss-Newton
with the Fisher information of both) finds its maximum with the priors. The covariance is H^-1 J H^-1 (H. White, Econometrica 50
(1982), 1-25). J comes from sums of the score over blocks, so that it holds for innovations that are not white. The
covariance includes errors of parameters that are not estimated (consider covariance; B. Tapley et al., Statistical Orbit
Determination, ch. 6).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear, minimize, minimize_scalar

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
from .sessions import STREAMS, RestPeriod, Rigging, channel_names
from .unknowns import Unknown

DIFFERENCE = 1e-3  # of a prior's deviation, of derivatives
BLOCK = 2.0  # s of a block of readings, which are taken to depend on each other
LOADS, USUAL = (1e-5, 0.3), 2.5e-3  # shares of the boom's weight, between which the load's size is looked for; at first


@dataclass(frozen=True)
class Noise:
    """Variances of the fast load in each rest period along x and y, (k, 2), N^2, and of the channels' noise (c,), SI."""

    loads: Array
    channels: Array


RestFilter = Callable[[Array, Array, Array], tuple[Array, Array]]
"""Variances of the fast load (2,), of the sensors' noise (c,), of zeros, see `filter_rest` -> innovations with their variances,
(r, 2), and the zeros at the end of the rest period."""


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
        at_rest, pairs = self._boom_at({}), zip(self._periods, usual.loads, strict=True)
        seen = [at_rest(period)(loads, usual.channels, self._zero2 + self._prior2)[1] for period, loads in pairs]
        zeros = dict(zip(self._zeroed, np.mean(seen, axis=0).tolist(), strict=True))
        return np.array([zeros.get(unknown.channel or "", 0.0) / unknown.kind.prior for unknown in self.unknowns])

    def values(self, deviations: Array) -> dict[str, float]:
        """Return the unknowns by name, SI."""
        return {unknown.name: unknown.value(at) for unknown, at in zip(self.unknowns, deviations.tolist(), strict=True)}

    def innovations(self, trials: Iterable[dict[str, float]], noise: Noise) -> list[Array]:
        """Return innovations and their variances, (r, 2), of several trials of parameters and zeros (SI, by name)."""

        def of(trial: dict[str, float]) -> Array:
            at_rest, pairs = self._boom_at(trial), zip(self._periods, noise.loads, strict=True)
            return np.concatenate([at_rest(period)(loads, noise.channels, self._zero2)[0] for period, loads in pairs])

        with ThreadPoolExecutor(usable_cores()) as pool:
            return list(pool.map(of, trials))

    def _boom_at(self, trial: dict[str, float]) -> Callable[[RestPeriod], RestFilter]:
        """Return a function that puts the boom of a trial to rest in a period, and returns its filter there.

        The boom has the parameters of the trial, and the trial's zeros are subtracted from the readings.
        """
        scene = with_parameters(self.scene, {name: value for name, value in trial.items() if not name.endswith(".zero")})
        zeros, rigging = np.array([trial.get(f"{name}.zero", 0.0) for name in self.names]), self._rigging
        boom = BoomPredictor(scene, rigging.settings, rigging.mounts, rigging.reads, rigging.places)

        def at_rest(period: RestPeriod) -> RestFilter:
            boom.start(period.strokes - zeros[: boom.plan.joints])
            readings = period.times, period.channels, period.values - zeros[period.channels]

            def filtered(loads: Array, sensors: Array, zero2: Array) -> tuple[Array, Array]:
                found, ends = np.empty((len(period.times), 2)), np.empty(len(zero2))
                own, axes = (boom.posture, boom.filters), (self._gravity, scene.base.inclination)
                filter_rest(*own, loads, zero2, *axes, *readings, sensors, found, ends)
                return found, ends

            return filtered

        return at_rest

    def noise(self, deviations: Array, sensors: Array) -> Noise:
        """Return the noise with the load of each rest period at its greatest likelihood; `sensors` (c,) is kept."""
        trial, bounds = self.values(deviations), np.log(np.array(LOADS) * self._weight)

        def most_likely(period: RestPeriod) -> Array:
            filtered = self._boom_at(trial)(period)

            def cost(sizes: Array) -> float:
                return likelihood_cost(filtered(np.exp(2.0 * sizes), sensors, self._zero2)[0])

            exact = {"xatol": 0.15}  # of the logarithm of the size
            both = minimize_scalar(lambda size: cost(np.full(2, size)), bounds=bounds, method="bounded", options=exact).x
            options = exact | {"fatol": 0.5, "initial_simplex": both + np.array([[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0]])}
            found = minimize(cost, np.full(2, both), method="Nelder-Mead", bounds=[tuple(bounds)] * 2, options=options).x
            return np.asarray(np.exp(2.0 * found))

        with ThreadPoolExecutor(usable_cores()) as pool:
            return Noise(np.array(list(pool.map(most_likely, self._periods))), sensors)

    def slopes(self, deviations: Array, noise: Noise) -> Array:
        """Return derivatives of innovations and variances by the unknowns, (p, r, 2).

        Differences are central. Zeros of strokes and angles nearly compensate each other, and differences to one side would
        leave a false gradient in that direction.
        """
        low = np.maximum(deviations - DIFFERENCE, self.least)
        ends = [np.where(own, end, deviations) for own in np.eye(len(low), dtype=bool) for end in (low + 2.0 * DIFFERENCE, low)]
        found = np.array(self.innovations(map(self.values, ends), noise))
        return np.asarray((found[::2] - found[1::2]) / (2.0 * DIFFERENCE))

    def slopes_by_model(self, deviations: Array, assumed: Sequence[Unknown], noise: Noise, base: Array) -> Array:
        """Return derivatives by parameters that are not estimated, in units of their standard deviations, (q, r, 2)."""
        own = self.values(deviations)
        trials = (own | {each.name: each.value(DIFFERENCE)} for each in assumed)
        return np.array([(found - base) / DIFFERENCE for found in self.innovations(trials, noise)]).reshape(-1, *base.shape)


def likelihood_cost(found: Array) -> float:
    """Return the negative log likelihood of innovations and variances (r, 2), up to a constant."""
    return float(0.5 * np.sum(found[:, 0] ** 2 / found[:, 1] + np.log(found[:, 1])))


MOST = 12  # passes
CLOSE = 0.05  # change of log likelihood by a whole step, below which both ends fit equally well


@dataclass(frozen=True)
class Fit:
    """Result of a fit; deviations of p unknowns are in standard deviations of their priors."""

    deviations: Array  # (p,), of the unknowns from their present values
    information: Array  # (p, p), Fisher's, without the priors
    scatter: Array  # (p, p), covariance of the score, from blocks of readings
    pull: Array  # (p,), remaining gradient of the log posterior; 0 except where a bound stops the fit
    by_model: Array  # (p, q), change of the score by parameters that are not estimated, per standard deviation of these
    misfits: Array  # (c,), rms of each channel's normalised innovations with the stated noise; 1: noise alone, or no readings
    passes: int
    is_settled: bool = True  # False if it still moved after `MOST` passes

    @property
    def precision(self) -> Array:
        """Information with that of the priors, (p, p)."""
        return np.asarray(self.information + np.eye(len(self.deviations)))

    def covariance(self) -> Array:
        """Return the covariance of the deviations, (p, p); variances are at least those for white innovations."""
        white = np.linalg.inv(self.precision)
        found = white @ (self.scatter + np.eye(len(white))) @ white
        factors = np.sqrt(np.maximum(1.0, np.diag(white) / np.diag(found)))
        shifts = white @ self.by_model
        return np.asarray(factors[:, None] * found * factors + shifts @ shifts.T)

    def without(self, left_out: Sequence[int], least: Array) -> Array:
        """Return the deviations (p,) of at least `least` (p,) that fit best where those in places `left_out` stay 0.

        The rest is fitted again, because an estimate that compensates a left-out one is wrong without it.
        """
        fixed = np.zeros(len(self.deviations), bool)
        fixed[list(left_out)] = True
        found = np.where(fixed, 0.0, self.deviations)
        if fixed.any() and not fixed.all():
            moved = self.precision[np.ix_(~fixed, fixed)] @ self.deviations[fixed]
            found[~fixed] += bounded_minimum(self.precision[np.ix_(~fixed, ~fixed)], moved, (least - found)[~fixed])
        return found


def bounded_minimum(precision: Array, pull: Array, least: Array) -> Array:
    """Return the x >= `least` that minimises x^T `precision` x / 2 - `pull`^T x; shapes (p, p), (p,), (p,)."""
    root = np.linalg.cholesky(precision)
    return np.asarray(lsq_linear(root.T, np.linalg.solve(root, pull), (least, np.inf), "bvls").x)


def fitted(problem: CalibrationProblem, assumed: Sequence[Unknown], tell: Callable[[int], None]) -> Fit:
    """Return the fit; `assumed` are parameters taken to be known, `tell` is given the number of each pass before it."""
    at, stated, change, learning = problem.start(), problem.sensor_noise(), np.inf, True
    for passes in range(1, MOST + 1):
        tell(passes)
        if learning:
            noise = problem.noise(at, stated)
        (base,) = problem.innovations([problem.values(at)], noise)
        slopes = problem.slopes(at, noise)
        score, information = _score(slopes, base)
        precision, pull = information + np.eye(len(at)), score.sum(axis=1) - at
        if change < CLOSE or passes == MOST:
            break
        step = bounded_minimum(precision, pull, problem.least - at)
        longest = max(1.0, float(np.abs(step).max()))
        step, change = _shortened(problem, at, step / longest, noise, base)  # one deviation of a prior at most
        at, change = at + step, change if longest == 1.0 else np.inf
        if learning and change < 0.5:  # within a standard deviation: near enough to learn the noise for the last time
            noise = problem.noise(at, np.maximum(stated, stated * _mean_squares(problem, base)))
            learning = False
    sums = np.array([np.bincount(problem.blocks, row) for row in score])
    by_model = _together(slopes, problem.slopes_by_model(at, assumed, noise, base), base)
    misfits = np.sqrt(_mean_squares(problem, base) * noise.channels / stated)
    return Fit(at, information, sums @ sums.T, pull, by_model, misfits, passes, change < CLOSE)


def _shortened(problem: CalibrationProblem, at: Array, step: Array, noise: Noise, base: Array) -> tuple[Array, float]:
    """Return a step, halved until it fits no worse, and how much the whole step changes the log posterior."""
    before, whole = likelihood_cost(base) + 0.5 * at @ at, np.inf
    for halvings in range(5):
        (found,) = problem.innovations([problem.values(at + step)], noise)
        change = float(likelihood_cost(found) + 0.5 * (at + step) @ (at + step) - before)
        whole = whole if halvings else abs(change)
        if change <= 0.0:
            break
        step = 0.5 * step
    return step, whole


def _mean_squares(problem: CalibrationProblem, base: Array) -> Array:
    """Return the mean square of the normalised innovations of each channel; 1 for one without readings."""
    counts = np.bincount(problem.channels, minlength=len(problem.names))
    sums = np.bincount(problem.channels, base[:, 0] ** 2 / base[:, 1], len(problem.names))
    return np.asarray(np.where(counts > 0, sums / np.maximum(counts, 1), 1.0))


def _score(slopes: Array, base: Array) -> tuple[Array, Array]:
    innovation, variance = base.T
    by_innovation, by_variance = slopes[:, :, 0], slopes[:, :, 1] / variance
    excess = innovation**2 / variance - 1.0
    score = -by_innovation * (innovation / variance) + 0.5 * by_variance * excess
    return score, _together(slopes, slopes, base)


def _together(slopes: Array, others: Array, base: Array) -> Array:
    """Return the Fisher information of the parameters of `slopes` (p, r, 2) with those of `others` (q, r, 2), (p, q)."""
    variance = base[:, 1]
    innovations = (slopes[:, :, 0] / variance) @ others[:, :, 0].T
    return np.asarray(innovations + 0.5 * (slopes[:, :, 1] / variance**2) @ others[:, :, 1].T)


@dataclass(frozen=True)
class InseparableUnknowns:
    """Unknowns that the sessions cannot separate; a single one cannot be determined."""

    names: tuple[str, ...]

    def __str__(self) -> str:
        what = f"{self.names[0]}: these sessions do not show it" if len(self.names) == 1 else (
            f"{', '.join(self.names)}: these sessions cannot tell them apart"
        )  # fmt: skip
        return f"{what}. Left as before. Record rests in other postures, after moves that make the boom swing."


def groups_of(problem: CalibrationProblem, fit: Fit) -> list[InseparableUnknowns]:
    """Return groups of unknowns with estimates too uncertain to be of use; a group holds those that are confused."""
    covariance = fit.covariance()
    spread = np.sqrt(np.diag(covariance))
    vague = spread > np.array([unknown.kind.useful / unknown.kind.prior for unknown in problem.unknowns])
    tied = np.abs(covariance) > 0.7 * np.outer(spread, spread)
    groups, left = [], set(np.flatnonzero(vague).tolist())
    while left:
        group: set[int] = set()
        grown = {min(left)}
        while grown != group:
            group, grown = grown, grown | set(np.flatnonzero(tied[sorted(grown)].any(axis=0) & vague).tolist())
        left -= group
        groups.append(InseparableUnknowns(tuple(problem.unknowns[i].name for i in sorted(group))))
    return groups
