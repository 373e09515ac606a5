"""Holds: what sensors read while the boom stands still, its free vibration among it, as linear problems.

A hold says more than its blocks of 0.1 s: the mean of the residuals without vibration, and the natural frequencies of the
posture, which stiffness and masses change, but no sensor does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...analysis.free_vibration import Vibration, free_vibrations, is_free
from ...kernels.jit import SameTypes
from ...types import NANO, Array
from .block_kernels import largest_step

PACE = 1e-4  # m of travel from block to block, above which a boom does not stand still
WHITE = 1.0  # see `_mean_at_rest`
LEAST, LONGEST = 3.0, 10.0  # s; of a longer one every part is a hold
RATE = 40.0  # Hz to which samples are thinned out
LAGS = 80  # of these samples, 2 s
SURE = 0.004  # largest relative deviation of a frequency
PART = 1.0  # s, over which means are compared, to see how calm a hold is
KEPT_UP = 0.5  # of the boom's own rate of decay, below which a load keeps a vibration up
COLOURED = 3.0  # times the power of white noise that is left, from which on something else than free vibration is in it
CERTAIN = 3.0  # standard deviations of the decay by which it has to be below that
FADED = 0.5  # of its own decay by which a vibration has to be less than in the part before of the same hold
SECOND_ORDER, MOVED = 50.0, 0.4  # 1/rad, and of a resolution: see `_with_second_order`

_largest_step = SameTypes(largest_step)


class StillReadings(NamedTuple):
    """What was read in a hold.

    Attributes
    ----------
    start, end : int
        ns.
    strokes : ndarray, shape (n,)
        m.
    left, unrest : ndarray, shape (channels,)
        Mean of the residuals, NaN where not measured, and how sure that is by its own scatter (standard deviation).
    vibrations : tuple of Vibration
        That show clearly, by frequency.
    """

    start: int
    end: int
    strokes: Array
    left: Array
    unrest: Array
    vibrations: tuple[Vibration, ...]


class HoldProblem(NamedTuple):
    """A hold, linearised; c channels, m natural frequencies that were measured.

    Attributes
    ----------
    start, end : int
        ns.
    strokes : ndarray, shape (n,)
        m.
    table, unrest : ndarray, shape (c, 1 + parameters), (c,)
        Residuals and signatures; standard deviation of the residuals by what happened in this hold.
    modes, frequencies, sigmas : ndarray, shape (m,), (m, 1 + parameters), (m,)
        Which mode of the model each is, from 0; measured frequency over the model's less 1, and its derivatives; standard
        deviation of the measured one.
    tip : ndarray, shape (2, parameters)
        Derivative of the tip's place, m.
    """

    start: int
    end: int
    strokes: Array
    table: Array
    unrest: Array
    modes: NDArray[np.int64]
    frequencies: Array
    sigmas: Array
    tip: Array


class HoldCollector:
    """Collects blocks while the boom stands still.

    Parameters
    ----------
    reach : float
        Of the boom, m.
    """

    def __init__(self, reach: float) -> None:
        self._reach = reach
        self._before: tuple[int, Array] | None = None  # start, frequencies and amplitudes of what this goes on with
        self._begin()

    def _begin(self) -> None:
        self._strokes: list[Array] = []
        self._left: list[Array] = []
        self._motion: list[tuple[NDArray[np.int64], Array]] = []
        self._is_felt = False
        self._starts: list[int] = []

    def take(
        self, start: int, left: Array, strokes: Array, motion: tuple[NDArray[np.int64], Array], is_felt: bool, block: int,
        decay: float,
    ) -> StillReadings | None:  # fmt: skip
        """One block of `block` ns; gives the hold that it ends, if that was long enough.

        Parameters
        ----------
        start : int
            ns.
        left, strokes : ndarray, shape (channels,), (n,)
            Means of the residuals; strokes, m.
        motion : tuple
            Stamps (k,) in ns and readings (k, any) of what shows vibration best.
        is_felt : bool
            Whether that is the IMU, m/s^2; else it is angles, rad.
        decay : float
            Rate (1/s) at which the power of the boom's most lasting free vibration decays.
        """
        is_next = bool(self._starts) and start - self._starts[-1] < 3 * block
        is_next = is_next and is_felt == self._is_felt
        is_still = is_next and _largest_step(strokes, self._strokes[-1]) < PACE
        found = None
        if self._starts and (not is_still or (start - self._starts[0]) * NANO >= LONGEST):
            found = self._finished(block, decay)
            if not is_still:
                self._before = None
            self._begin()
        self._starts.append(start)
        self._strokes.append(strokes)
        self._left.append(left)
        self._motion.append(motion)
        self._is_felt = is_felt
        return found

    def _finished(self, block: int, decay: float) -> StillReadings | None:
        span = (self._starts[-1] + block - self._starts[0]) * NANO
        if span < LEAST:
            return None
        strokes = np.median(np.array(self._strokes), axis=0)
        stamps = np.concatenate([stamps for stamps, _ in self._motion])
        values = np.concatenate([values for _, values in self._motion])
        dt, thin = _thinned(stamps, values)
        vibrations = free_vibrations(dt, thin, LAGS)
        is_shaken = not _is_explained(dt, thin, vibrations) or any(_is_kept_up(each, decay) for each in vibrations)
        part = 1 if is_shaken else max(1, round(PART / (block * NANO)))
        left, unrest = _mean_at_rest(np.array(self._left), part, is_shaken)
        clear = [] if is_shaken else [each for each in vibrations if is_free(each) and _is_sure(each) and self._fades(each)]
        self._before = self._starts[0], np.array([(each.frequency, each.amplitude) for each in vibrations]).reshape(-1, 2).T
        sure = filter(_is_sure, _with_second_order(clear, span, self._reach if self._is_felt else None))
        return StillReadings(self._starts[0], self._starts[-1] + block, strokes, left, unrest, tuple(sure))

    def _fades(self, vibration: Vibration) -> bool:
        """Whether a vibration has become less since the part of the same hold before, as its own decay says; True without one.

        A line, as of an engine, whose neighbours are not told from it, or whose noise comes again and again, may seem damped.
        """
        if self._before is None:
            return True
        start, (frequencies, amplitudes) = self._before
        time = (self._starts[0] - start) * NANO
        wanted = FADED * 2.0 * np.pi * vibration.frequency * vibration.damping * time
        earlier = amplitudes[np.abs(frequencies - vibration.frequency) < 1.0 / time].max(initial=0.0)
        return earlier == 0.0 or bool(np.log(earlier / vibration.amplitude) > wanted)


def _is_sure(each: Vibration) -> bool:
    return each.frequency_sigma < SURE * each.frequency


def _with_second_order(vibrations: list[Vibration], span: float, reach: float | None) -> list[Vibration]:
    """The vibrations of a hold of `span` (s), their frequencies as unsure as vibrations of second order make them.

    A boom that swings far is no linear system: two of its vibrations, or one with itself, give more, at the sum and the
    difference of their frequencies, of `SECOND_ORDER` times the product of their amplitudes (rad; of accelerations at the end
    of a boom of `reach` (m), by the frequency). In fast moves of booms in Exudyn that factor is 1 to 10, and 50 near a natural
    frequency, in resonance (2 x 1.294 Hz beside 2.78); they turn the boom less than the two that they come from. What is nearer
    to another than the span resolves is not told from it: it moves its frequency by `MOVED` of the resolution times the ratio
    of amplitudes, and may be all of what was taken for it.
    """
    if not vibrations:
        return []
    frequencies, amplitudes = (np.array(each) for each in zip(*((v.frequency, v.amplitude) for v in vibrations), strict=True))
    turns = amplitudes if reach is None else amplitudes / ((2.0 * np.pi * frequencies) ** 2 * reach)
    first, second = np.triu_indices(len(vibrations))
    sizes = SECOND_ORDER * turns[first] * amplitudes[second]
    is_less, moved = turns[:, None] < np.minimum(turns[first], turns[second]), np.zeros(len(vibrations))
    for sign in (1.0, -1.0):
        forced = np.abs(frequencies[first] + sign * frequencies[second])
        moved += (is_less & (np.abs(forced - frequencies[:, None]) < 1.0 / span)) @ sizes
    moved *= MOVED / span / amplitudes
    sigmas = np.hypot([each.frequency_sigma for each in vibrations], moved).tolist()
    return [replace(each, frequency_sigma=sigma) for each, sigma in zip(vibrations, sigmas, strict=True)]


def _is_kept_up(each: Vibration, decay: float) -> bool:
    """Return True if a vibration decays more slowly than any of the boom (`decay`, 1/s, of its power): a load shakes it."""
    return 4.0 * np.pi * each.frequency * (each.damping + CERTAIN * each.damping_sigma) < KEPT_UP * decay


def _is_explained(dt: float, values: Array, vibrations: list[Vibration]) -> bool:
    """Whether these vibrations and noise are all that there is in `values` (k, c), `dt` (s) apart: no wind, no pump's steps."""
    if len(values) < 8:
        return True
    omegas = 2.0 * np.pi * np.array([each.frequency for each in vibrations])
    decays = omegas * np.array([each.damping for each in vibrations])
    times = dt * np.arange(float(len(values)))[:, None]
    turns, sizes = np.sqrt(np.maximum(omegas**2 - decays**2, 0.0)) * times, np.exp(-decays * times)
    basis = np.linalg.qr(np.hstack([sizes * np.cos(turns), sizes * np.sin(turns), np.ones_like(times)]))[0]
    rest = values - basis @ (basis.T @ values)
    noise = (np.diff(rest, 2, axis=0) ** 2).mean(axis=0) / 6.0
    return bool((rest**2).mean(axis=0).sum() < COLOURED * noise.sum())


def _mean_at_rest(left: Array, part: int, is_shaken: bool) -> tuple[Array, Array]:
    """Mean (channels,) of means of blocks (k, channels), and its deviation by the scatter of parts of so many blocks.

    Where a load shakes the boom, its mean may be as large as its level: the deviation is the scatter itself. Three parts that
    happen to agree are no sign of rest: the scatter that blocks would leave in a part if they were independent counts as
    `WHITE` parts more.
    """
    weights = np.where(np.isfinite(left), np.sin(np.pi * (np.arange(len(left)) + 0.5) / len(left))[:, None] ** 2, 0.0)
    total = weights.sum(axis=0)
    mean = (np.where(np.isfinite(left), left, 0.0) * weights).sum(axis=0) / np.maximum(total, 1e-300)
    mean[total < 0.25 * len(left)] = np.nan  # half of the weight of all of them
    count = len(left) // part
    parts = left[: count * part].reshape(count, part, -1).mean(axis=1)
    (squares, free), (white, blocks) = _squares(parts), _squares(left)
    scatter = (squares + WHITE / part * white / np.maximum(blocks, 1)) / (free + WHITE)
    return mean, np.sqrt(scatter if is_shaken else scatter / (free + 1))


def _squares(values: Array) -> tuple[Array, Array]:
    """Sum (channels,) of squares of values (k, channels) about their mean, and how many but one are known."""
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=0), 1)
    middle = np.where(known, values, 0.0).sum(axis=0) / count
    return (np.where(known, values - middle, 0.0) ** 2).sum(axis=0), count - 1


def _thinned(stamps: NDArray[np.int64], values: Array) -> tuple[float, Array]:
    """Step (s) and values (k, c) at even times; nothing where there is too little."""
    known = np.isfinite(values).all(axis=1) if values.size else np.zeros(0, bool)
    if known.sum() < 2:
        return 1.0, np.zeros((0, 1))
    order = np.flatnonzero(known)[np.argsort(stamps[known], kind="stable")]  # samples may be late
    times, rows = np.asarray(stamps[order] - stamps[0]) * NANO, values[order]
    interval = float(np.median(np.diff(times)))
    if interval <= 0.0:
        return 1.0, np.zeros((0, 1))
    step = max(1, round(1.0 / (RATE * interval)))
    even = times[0] + interval * np.arange(int((times[-1] - times[0]) / interval) // step * step)
    thin = np.stack([np.interp(even, times, column) for column in rows.T], axis=1)
    return step * interval, thin.reshape(-1, step, rows.shape[1]).mean(axis=1)
