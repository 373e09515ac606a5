"""Measured natural frequencies and damping while the boom stood still, beside the model's.

The samples of all channels are stacked into Hankel matrices; what is shifted by one sample spans the same signal space, turned
by exp(lambda dt) per mode (ERA: Juang and Pappa 1985, doi 10.2514/3.20031). Amplitudes follow by least squares. How sure a
frequency is, is told by the covariance of all parameters for white noise as large as what the modes leave.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.signal import decimate

from ..monitor.data.analyst import ModeList
from ..plots import History
from ..scene.schema import Scene
from ..types import Array, Stream, stream_of

ORDER = 14
"""Eigenvalues that are looked for: two a mode, and some that take up noise."""
RATE = 40.0
"""Hz to which samples are thinned out."""
LOWEST, HIGHEST = 0.2, 15.0
DAMPED = 0.2
"""Largest damping ratio of what is taken for a mode."""


@dataclass(frozen=True, slots=True)
class Vibration:
    """One mode: frequency (Hz) and damping ratio, with their standard deviations."""

    frequency: float
    frequency_sigma: float
    damping: float
    damping_sigma: float


def vibrations(times: Array, values: Array) -> list[Vibration]:
    """Modes by frequency in `values` (k, c) at `times` (k,) in s; none of less than a second or two."""
    dt, x = _thinned(times, values)
    if len(x) < 3 * ORDER or not x.any():
        return []
    x = np.asarray(x - x.mean(axis=0), np.float64)
    lags = len(x) // 3
    hankel = np.hstack([np.lib.stride_tricks.sliding_window_view(column, len(x) - lags) for column in x.T])
    space = np.linalg.svd(hankel, full_matrices=False)[0][:, :ORDER]
    turns = np.linalg.eigvals(np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0])
    rates = np.log(turns[turns.imag > 0.0]) / dt
    frequencies, dampings = np.abs(rates) / (2.0 * pi), -rates.real / np.abs(rates)
    kept = (frequencies > LOWEST) & (frequencies < min(HIGHEST, 0.4 / dt)) & (dampings > 0.0) & (dampings < DAMPED)
    rates = rates[kept][np.argsort(frequencies[kept])]
    sigmas = _sigmas(dt * np.arange(float(len(x))), x, rates) if len(rates) else np.zeros((0, 2))
    return [_vibration(rate, sigma) for rate, sigma in zip(rates, sigmas, strict=True)]


def _thinned(times: Array, values: Array) -> tuple[float, Array]:
    """Step (s) and values (n, c) at even times, low-pass filtered; nothing where there is too little to filter."""
    columns = [column for column in values.T if 2 * np.isfinite(column).sum() > len(column)]
    if len(times) < 2 or not columns:
        return 1.0, np.zeros((0, 1))
    interval = float(np.median(np.diff(times)))
    even = np.arange(times[0], times[-1], interval)
    rows = np.stack([np.interp(even, times[np.isfinite(c)], c[np.isfinite(c)]) for c in columns], axis=1)
    step = max(1, round(1.0 / (RATE * interval)))
    if len(rows) < 3 * ORDER * step:
        return 1.0, np.zeros((0, 1))
    return step * interval, rows if step == 1 else np.asarray(decimate(rows, step, axis=0))


def _sigmas(times: Array, x: Array, rates: np.ndarray) -> Array:
    """Standard deviations of real and imaginary part of every rate (1/s), shape (modes, 2)."""
    waves = np.exp(rates[None, :] * times[:, None])
    linear = np.hstack([waves.real, -waves.imag, np.ones((len(times), 1))])
    amplitudes = np.linalg.lstsq(linear, x, rcond=None)[0]
    noise = float(np.square(x - linear @ amplitudes).sum() / max(x.size - linear.shape[1] * x.shape[1] - 2 * len(rates), 1))
    complexes = amplitudes[: len(rates)] + 1j * amplitudes[len(rates) : 2 * len(rates)]
    slopes = times[:, None, None] * waves[:, :, None] * complexes[None]
    by_rates = np.concatenate([slopes.real, -slopes.imag], axis=1)
    # what amplitudes can make up for is no information on rates
    basis = np.linalg.qr(linear)[0]
    left = by_rates - np.einsum("ta,ba,bmc->tmc", basis, basis, by_rates)
    information = np.einsum("tmc,tnc->mn", left, left)
    covariance = noise * np.linalg.pinv(information, hermitian=True)
    return np.sqrt(np.maximum(np.diag(covariance), 0.0)).reshape(2, -1).T


def _vibration(rate: complex, sigmas: Array) -> Vibration:
    size = abs(rate)
    return Vibration(float(size) / (2.0 * pi), float(sigmas[1]) / (2.0 * pi), float(-rate.real / size), float(sigmas[0] / size))


PACE = 1e-3
"""m/s of every stroke, above which a boom does not stand still."""
OVER = 0.2
"""s over which the pace is taken."""
LEAST = 3.0
"""s; the shortest stretch that is looked at."""
NEAR = 0.2
"""A vibration belongs to the nearest mode of the model, if it is no further from it than this share."""
SURE = 0.02
"""Largest standard deviation of a frequency, in cycles over the stretch; in noise alone it is about 0.2."""
POINTS = 60
"""Most times at which the model's frequencies are told."""


@dataclass(frozen=True, slots=True)
class HoldInterval:
    """A stretch (s since the first sample) of standing still; the model's frequencies (Hz), and by mode what was measured."""

    start: float
    stop: float
    model: list[float]
    measured: dict[int, Vibration]


def holds(history: History, scene: Scene) -> list[HoldInterval]:
    """All stretches of a session in which the boom stood still for `LEAST`."""
    times, values = measured_motion(history)
    modes, found = ModeList(scene), []
    for start, stop in still(history.stamps_s, history.strokes):
        inside, there = _between(history.stamps_s, start, stop), _between(times, start, stop)
        model = modes.at(np.median(history.strokes[inside], axis=0).tolist())
        sure = [each for each in vibrations(times[there], values[there]) if each.frequency_sigma * (stop - start) < SURE]
        found.append(HoldInterval(start, stop, model, _by_mode(sure, model)))
    return found


def course(history: History, scene: Scene) -> tuple[Array, Array]:
    """Times (k,) in s and natural frequencies (k, modes) of the model in the postures then; NaN without an equilibrium."""
    modes, count = ModeList(scene), len(history.stamps_s)
    places = np.unique(np.linspace(0, count - 1, min(count, POINTS)).astype(int))
    rows = [modes.at(history.strokes[place].tolist()) for place in places]
    table = np.full((len(rows), max(map(len, rows))), np.nan)
    for row, found in zip(table, rows, strict=True):
        row[: len(found)] = found
    return history.stamps_s[places], table


def still(times: Array, strokes: Array) -> list[tuple[float, float]]:
    """From and to (s) where no stroke (k, n) moved faster than `PACE`, for `LEAST` at least."""
    if len(times) < 2:
        return []
    before, after = (np.clip(np.searchsorted(times, times + half), 0, len(times) - 1) for half in (-OVER / 2, OVER / 2))
    span = np.maximum(times[after] - times[before], 1e-9)
    calm = np.abs(strokes[after] - strokes[before]).max(axis=1) < PACE * span
    edges = np.flatnonzero(np.diff(np.concatenate([[0], calm.astype(int), [0]])))
    spans = [(float(times[a]), float(times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [(start, stop) for start, stop in spans if stop - start >= LEAST]


def measured_motion(history: History) -> tuple[Array, Array]:
    """Times (k,) and values (k, c): the IMU's specific force (m/s^2), or without one the angles (rad)."""
    if history.imu is not None:
        return history.imu.stamps_s, history.imu.measured
    places = [i for i, name in enumerate(history.residual_names) if stream_of(name) is Stream.ANGLES]
    there = np.isfinite(history.residual_values[:, places]).any(axis=1)
    times, left = history.residual_stamps_s[there], history.residual_values[there][:, places]
    predicted = [np.interp(times, history.stamps_s, history.joints[:, i]) for i in range(len(places))]
    return times, left + np.stack(predicted, axis=1) if places else left


def _between(times: Array, start: float, stop: float) -> np.ndarray:
    return np.asarray((times >= start) & (times < stop))


def _by_mode(found: list[Vibration], model: list[float]) -> dict[int, Vibration]:
    """The surest vibration near every mode."""
    near: dict[int, Vibration] = {}
    for each in found if model else ():
        mode = int(np.argmin(np.abs(np.array(model) - each.frequency)))
        is_near = abs(each.frequency - model[mode]) <= NEAR * model[mode]
        if is_near and (mode not in near or each.frequency_sigma < near[mode].frequency_sigma):
            near[mode] = each
    return near
