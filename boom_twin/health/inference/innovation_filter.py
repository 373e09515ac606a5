"""Kalman filter that whitens residuals: takes out the vibration and the slow errors that a good model still leaves.

Two kinds of deviation are no fault. What strokes' noise shakes out of the natural modes, and what a model leaves of a
vibration whose frequency it has a little wrong: per mode a coordinate eta with eta'' + 2 zeta omega eta' + omega^2 eta = w;
w is white, of the density that

- gives eta the variance that stroke noise collects in the mode (see `boom_twin.analysis.modal`), and
- lets a vibration of the predicted size lose step with the real one as if its frequency were wrong by the share `detuning`
  within one second: detuning^2 omega^4 A^2 1 s, where A^2 is the mean square of the predicted coordinate.

The shape of a mode is wrong, too: every channel has a noise of its own, of `SHAPE` times what it reads of that vibration, for
stiffness and masses that are within 2 % bend a mode by about as much however well its frequency is met, and of `SHIFTED`
detuning times that, for what shifts a frequency. What is out of step already where a filter begins is among its state: see
`out_of_step`. Vibration that nobody predicted, by a load, counts likewise: see `InnovationFilter.vibration`.

And what linkages, masses and bending are a little wrong by: an error of each channel that is another one in every posture, of
a given deviation, with a correlation exp(-travel / REACH) over the travel of the strokes.

A third one is a force at the tip that the model does not know, by a pump or the wind: a Gauss-Markov process of a given level
(N, standard deviation of each component) and correlation time `LOAD_TIME`, about a mean that is not known either, as a pump's
thrust has one, of `MEAN` times that level. It drives the modes as it drives the boom; modes above `HIGHEST` follow it at once.
How large the level is nobody knows: filters with several levels run side by side, and how probable each makes what was measured
tells.

A Kalman filter on all these turns the means of residuals in blocks into innovations: white and of unit variance while all is
well, but for what parameters add. Its gains do not depend on what is measured, so the same filter run over the signature of a
parameter tells how that parameter shows in the innovations (Willsky and Jones 1976).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...analysis.modal import Mode, StrokeNoise, along
from ...compiler.plan import Plan
from ...deviation.sensor_model import Reading, specific_force
from ...estimation.deviation_filter import oscillate
from ...kernels.jit import SameTypes, hold
from ...kernels.tables import FRAME_ANGLE, State, Work
from ...types import Array
from .kalman_update import LOAD, FilterWork, filter_block

HIGHEST = 8.0  # Hz; faster vibration is averaged out within a block
KEEPS_STEP = 1.0  # s, see above
LEAST_DAMPING = 2e-4  # of omega, so that every mode has a finite variance
SHAPE, SHIFTED = 0.02, 0.5  # see above
REACH = 0.05  # m of travel
REST = 1e-3  # m/s of travel that time stands for while the boom rests
LOAD_TIME, MEAN_TIME = 2.0, 60.0  # s, correlation of the load about its mean, and of that
ROUGH = 0.5  # share of what the load adds to readings at once by which they may be off: it changes within a block
MEAN = 1.0  # see above
CALM = 2.0  # s, over which vibration that was found is remembered
BOTH = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]])  # what of these is the whole load


class ModalStates(NamedTuple):
    """Of one posture: c channels, m modes below `HIGHEST`.

    Attributes
    ----------
    frequencies : ndarray, shape (m,)
        Hz.
    turn, least, driven : ndarray, shape (2 m, 2 m)
        What coordinates and their rates become within a block; covariance that stroke noise adds, and that wrong frequencies
        add for a mean square of the tip's acceleration of 1 (m/s^2)^2 and a detuning of 1.
    rest : ndarray, shape (2 m, 2 m)
        Their covariance after long shaking by stroke noise.
    shown : ndarray, shape (c, 2 m)
        How the means of the channels read them.
    shaken : ndarray, shape (c,)
        Mean square of what they read while the mean square of the tip's acceleration is 1 (m/s^2)^2.
    pushed : ndarray, shape (2 m, 2)
        What a force of 1 N at the tip along x and y makes of coordinates and rates within a block.
    lifted : ndarray, shape (c, 2)
        What the channels read of it at once: the acceleration of these modes, the deflection of the others.
    """

    frequencies: Array
    turn: Array
    least: Array
    driven: Array
    rest: Array
    shown: Array
    shaken: Array
    pushed: Array
    lifted: Array


def modes_of(noise: StrokeNoise, read: ReadModes, block: float, before: ModalStates | None) -> ModalStates:
    """The modes of a posture, as sensors read them, for blocks of `block` s; of the signs of those `before`."""
    size, channels, h = sum(mode.frequency < HIGHEST for mode in noise.modes), read.still.shape[1], block
    turn, driven, unknown = (np.zeros((2 * size, 2 * size)) for _ in range(3))
    shown, shaken = np.zeros((channels, 2 * size)), np.zeros(channels)
    pushed, lifted = np.zeros((2 * size, 2)), np.zeros((channels, 2))
    for k, (mode, still, felt) in enumerate(zip(noise.modes, read.still, read.felt, strict=True)):
        omega, motion = 2.0 * math.pi * mode.frequency, noise.motions[k]
        if k >= size:
            lifted += np.outer(still, motion) / omega**2
            continue
        at, swing = slice(2 * k, 2 * k + 2), max(float(np.hypot(*motion)), 1e-12)
        turn[at, at] = own = oscillation(omega, max(noise.decay[k], LEAST_DAMPING * omega), h)
        driven[at, at] = KEEPS_STEP / swing**2 * np.array([[h**3 / 3.0, h * h / 2.0], [h * h / 2.0, h]])
        swinging, passed = still - omega**2 * felt, float(np.sinc(mode.frequency * h))
        shown[:, 2 * k] = passed * swinging
        pushed[at] = np.outer([(1.0 - own[0, 0]) / omega**2, -own[1, 0] / omega**2], motion)
        lifted += np.outer(felt + (1.0 - passed) * swinging / omega**2, motion)  # no mean of a block lessens what rests
        if before is not None and 2 * k < before.shown.shape[1] and shown[:, 2 * k] @ before.shown[:, 2 * k] < 0.0:
            shown[:, 2 * k] *= -1.0
            pushed[at] *= -1.0
        shaken += (shown[:, 2 * k] / (omega * omega * swing)) ** 2
    frequencies = np.array([mode.frequency for mode in noise.modes[:size]])
    return shaken_by(noise, ModalStates(frequencies, turn, unknown, driven, unknown, shown, shaken, pushed, lifted))


def shaken_by(noise: StrokeNoise, modes: ModalStates) -> ModalStates:
    """The same modes where strokes' noise has shaken them as it now does."""
    size = len(modes.frequencies)
    spread = np.column_stack([noise.collected[:size], noise.collected[:size] * (2.0 * math.pi * modes.frequencies) ** 2])
    rest = np.diag(spread.ravel())
    return modes._replace(rest=rest, least=rest - modes.turn @ rest @ modes.turn.T)


def oscillation(omega: float, decay: float, h: float) -> Array:
    """What position and velocity of eta'' + decay eta' + omega^2 eta = 0 become within h (s); shape (2, 2), exact."""
    return np.array(oscillate(omega, decay, h)).reshape(2, 2)


class ReadModes(NamedTuple):
    """How c channels read m modes of a posture.

    Attributes
    ----------
    still, felt : ndarray, shape (m, c)
        A mode's coordinate that rests at 1, and its acceleration of 1.
    """

    still: Array
    felt: Array


def read_modes(modes: tuple[Mode, ...], plan: Plan, state: State, work: Work, reading: Reading) -> ReadModes:
    """How the sensors read modes, where the boom is at rest in `state`."""
    n, angle = plan.joints, float(state.frames[-1, FRAME_ANGLE])
    still, felt = np.zeros((len(modes), n + 2)), np.zeros((len(modes), n + 2))
    for k, mode in enumerate(modes):
        still[k] = along(plan, state, work, mode.increments, lambda: reading.of(state)[: n + 2])
        felt[k, n:] = specific_force(*mode.motion[plan.tables.tip : plan.tables.tip + 2], math.cos(angle), math.sin(angle))
    return ReadModes(still, felt)


class Innovations(NamedTuple):
    """Of one block.

    Attributes
    ----------
    white : ndarray, shape (..., measured, columns)
        In the order of the channels that were measured; each row of unit variance and independent of the others.
    log : ndarray, shape (...)
        Logarithm of the probability density of column 0, but for a constant.
    """

    white: Array
    log: Array


class InnovationFilter:
    """Filters several columns at once: column 0 the residuals, the others signatures; under one level of the load or several.

    Parameters
    ----------
    channels, columns : int
    block : float
        Length of a block, s.
    detuning : float or ndarray, shape (...)
        Share by which natural frequencies may be wrong, under each level.
    level : float or ndarray, shape (...)
        Of the unknown load, N. All levels are filtered in the same calls, as a filter of each alone would do to the bit.
    """

    def __init__(self, channels: int, columns: int, block: float, detuning: float | Array, level: float | Array = 0.0) -> None:
        self._block, self._channels, self._levels = block, channels, np.shape(level)
        self._level2 = np.ravel(level)[:, None] ** 2
        self._detuning2 = np.broadcast_to(detuning, self._levels).ravel() ** 2
        count, others = len(self._level2), LOAD + channels
        self._x, self._p = np.zeros((count, others, columns)), np.zeros((count, others, others))
        self._stationary = self._level2 * np.array([1.0, 1.0, MEAN**2, MEAN**2])
        self._p[:, :LOAD, :LOAD] = _diagonal(self._stationary)
        self._kept = np.exp(-block / np.array([LOAD_TIME, LOAD_TIME, MEAN_TIME, MEAN_TIME]))
        self._fresh, self._size = True, 0
        self._swinging = np.zeros(count)  # mean square of the tip's acceleration by vibration that was found
        self._posture: ModalStates | None = None
        self._work: FilterWork  # of that posture
        self._filter_block = SameTypes(filter_block)

    def tune(self, modes: ModalStates) -> None:
        """Take the modes of a posture, if they are others; coordinates of modes that were there go on."""
        before, self._posture = self._posture, modes
        if before is not None and modes.turn is before.turn:
            if modes is not before:
                self._work.least[: self._size, : self._size] = modes.least
            return
        size, old, others = len(modes.turn), self._size, LOAD + self._channels
        kept = min(size, old)
        places = [*range(kept), *range(old, old + others)]
        at = [*range(kept), *range(size, size + others)]
        count, states, columns = len(self._level2), size + others, self._x.shape[-1]
        x, p = np.zeros((count, states, columns)), np.zeros((count, states, states))
        p[:, :size, :size] = modes.rest
        (to, across), (of, beside) = np.ix_(at, at), np.ix_(places, places)
        x[:, at], p[:, to, across] = self._x[:, places], self._p[:, of, beside]
        self._x, self._p, self._size = x, p, size
        at_once = self._level2 * (modes.lifted**2).sum(axis=1)
        turn, least, driven = np.eye(states), np.zeros((states, states)), np.zeros((states, states))
        turn[:size, :size] = modes.turn
        turn[:size, size : size + LOAD] = np.hstack([modes.pushed, modes.pushed])
        turn[size : size + LOAD, size : size + LOAD] = np.diag(self._kept)
        least[:size, :size], driven[:size, :size] = modes.least, modes.driven
        added = np.zeros((count, states))
        added[:, size : size + LOAD] = (1.0 - self._kept**2) * self._stationary
        if before is None:
            p[:, :size, :size] += _swung(modes, self._level2)
        channels, self._rough = self._channels, ROUGH**2 * at_once
        self._work = FilterWork(
            turn=turn, least=least, driven=driven, detuning2=self._detuning2,
            shape2=SHAPE**2 + SHIFTED**2 * self._detuning2, added=added,
            shown=np.hstack([modes.shown, modes.lifted, modes.lifted, np.eye(channels)]),
            shaken=modes.shaken, rough=self._rough.copy(), pushed=at_once[:, -2:].sum(axis=1),
            swinging=self._swinging, x=x, p=p, rows=np.zeros(channels, np.int64), own=np.zeros(channels),
            scratch=np.zeros((states, max(states, columns))), root=np.zeros((channels, channels)),
            gain=np.zeros((channels, states)),
        )  # fmt: skip
        self._held = hold(self._work)

    def roughen(self, variances: Array) -> None:
        """Let readings be off by further `variances`, shape (levels, channels), under a load of each level."""
        self._work.rough[:] = self._rough + variances

    def step(self, table: Array, noise: Array, errors2: Array, shaking: float | Array, travel: float) -> Innovations:
        """Innovations of one block.

        Parameters
        ----------
        table : ndarray, shape (channels, columns)
            Column 0 the residuals' means, NaN where nothing was measured; the others the signatures.
        noise : ndarray, shape (channels, channels)
            Covariance of the means by sensor and stroke noise.
        errors2 : ndarray, shape (channels,)
            Variance of the model's error in one posture.
        shaking : float or ndarray, shape (levels,)
            Mean square of the tip's acceleration by vibration lately, (m/s^2)^2.
        travel : float
            Of the strokes since the block before, m.

        Returns
        -------
        Innovations
            Of the channels that were measured, and the probability of the residuals among them.
        """
        kept = 0.0 if self._fresh else math.exp(-(travel + REST * self._block) / REACH)
        if self._fresh and self._posture is not None:
            at = np.arange(self._size)
            self._p[:, at, at] += out_of_step(self._posture, self._detuning2[:, None], self._block) * np.reshape(
                shaking, (-1, 1)
            )
        self._fresh = False
        count, calm = len(self._level2), math.exp(-self._block / CALM)
        white, log, lately = np.empty((count, *table.shape)), np.empty(count), np.empty(count)
        lately[:] = shaking
        measured = self._filter_block(self._held, table, noise, errors2, lately, kept, calm, white, log)
        if math.isnan(log.sum()):
            raise np.linalg.LinAlgError("covariance of innovations: not positive definite")
        return Innovations(white[:, :measured].reshape(*self._levels, measured, table.shape[1]), log.reshape(self._levels))

    def vibration(self, predicted: float) -> Array:
        """Mean square of the tip's acceleration lately, (m/s^2)^2, shape (levels,): as `predicted`, or as found where more."""
        return np.maximum(predicted, self._swinging)

    def load(self, mean: Array, covariance: Array) -> tuple[Array, Array]:
        """Force at the tip along x and y, shape (..., 2), and its covariance, shape (..., 2, 2); N, after the newest block.

        Parameters
        ----------
        mean, covariance : ndarray, shape (k,), (k, k)
            Of the parameters of the first k signatures.
        """
        here = slice(self._size, self._size + LOAD)
        by, k = BOTH @ self._x[:, here, 1:], len(mean)
        force = (BOTH @ self._x[:, here, :1])[..., 0] - by[..., :k] @ mean
        spread = BOTH @ self._p[:, here, here] @ BOTH.T + by[..., :k] @ covariance @ by[..., :k].mT
        return force.reshape(*self._levels, 2), spread.reshape(*self._levels, 2, 2)


def _diagonal(values: Array) -> Array:
    """Matrices (..., k, k) with `values` (..., k) on their diagonals."""
    return np.asarray(values[..., None] * np.eye(values.shape[-1]))


def out_of_step(modes: ModalStates, detuning2: Array, block: float) -> Array:
    """Variances (levels, 2 m) of what a start finds out of step of a vibration of a mean square of 1 (m/s^2)^2.

    What white noise of the density above has collected for as long as vibration takes to decay, at most all of the vibration.
    """
    omegas2 = (2.0 * math.pi * modes.frequencies) ** 2
    turns, starts = modes.turn, np.arange(0, len(modes.turn), 2)
    left = turns[starts, starts] * turns[starts + 1, starts + 1] - turns[starts, starts + 1] * turns[starts + 1, starts]
    decays, density = -np.log(left) / block, modes.driven.diagonal()[1::2] / block
    rates = density * np.minimum(detuning2 / (2.0 * decays), 1.0 / (KEEPS_STEP * omegas2))
    found = np.empty((len(detuning2), len(turns)))
    found[:, 0::2], found[:, 1::2] = rates / omegas2, rates
    return found


def _swung(modes: ModalStates, level2: Array) -> Array:
    """Covariance (..., 2 m, 2 m) of the modes' coordinates that loads of levels (..., 1) brought about before the start."""
    turn, pushed = modes.turn, modes.pushed
    still = np.linalg.solve(np.eye(len(turn)) - turn, pushed) if len(turn) else pushed
    omegas = 2.0 * math.pi * np.repeat(modes.frequencies, 2)
    spread = (1.0 + MEAN**2) * level2 * (still**2).sum(axis=1)
    spread[..., 1::2] = spread[..., 0::2] * omegas[0::2] ** 2
    return _diagonal(spread)
