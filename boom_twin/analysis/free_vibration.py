"""Natural frequencies and damping of free vibration, from samples of sensors at even times.

The samples of all channels are stacked into Hankel matrices; what is shifted by one sample spans the same signal space, turned
by exp(lambda dt) per mode (ERA: Juang and Pappa 1985, doi 10.2514/3.20031). Amplitudes follow by least squares, and a step of
Gauss and Newton takes the rates there, too: without it errors are larger than the covariance of least squares. How sure a
frequency is, is told by that covariance of all parameters, for white noise as large as what the modes leave; near a frequency
where they leave more than elsewhere, since a vibration was missed or two were taken for one, as large as it is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from ..types import Array

ORDER = 14  # eigenvalues that are looked for: two a mode, and some that take up noise
DECAYS = 4.0  # deviations by which a vibration has to be damped: the line of a pump is not


@dataclass(frozen=True, slots=True)
class Vibration:
    """One mode: frequency (Hz) and damping ratio, with their standard deviations."""

    frequency: float
    frequency_sigma: float
    damping: float
    damping_sigma: float


def free_vibrations(dt: float, values: Array) -> list[Vibration]:
    """Return the modes by frequency in `values` (k, c), `dt` (s) apart; none of fewer than 3 `ORDER` rows."""
    longest_step = 5.0  # deviations of a rate by which least squares may move it; a longer step is not linear
    damped = 0.2  # largest damping ratio of what is taken for a mode
    lowest_hz, highest_hz = 0.2, 15.0
    if len(values) < 3 * ORDER or not values.any():
        return []
    x = np.asarray(values - values.mean(axis=0), np.float64)
    lags = len(x) // 3  # rows of a Hankel matrix
    hankel = np.hstack([np.lib.stride_tricks.sliding_window_view(column, len(x) - lags) for column in x.T])
    space = np.linalg.eigh(hankel @ hankel.T)[1][:, : -ORDER - 1 : -1]  # its left singular vectors, in a sixth of the time
    turns = np.linalg.eigvals(np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0])
    rates = np.log(turns[turns.imag > 0.0]) / dt
    frequencies, dampings = np.abs(rates) / (2.0 * pi), -rates.real / np.abs(rates)
    kept = (frequencies > lowest_hz) & (frequencies < min(highest_hz, 0.4 / dt)) & (dampings > 0.0) & (dampings < damped)
    rates = rates[kept][np.argsort(frequencies[kept])]
    if not len(rates):
        return []
    step, sigmas = _refined(dt * np.arange(float(len(x))), x, rates)
    rates = rates + np.where(np.abs(step) < longest_step * sigmas.max(axis=1), step, 0.0)
    return [_vibration(*each) for each in zip(rates, sigmas, strict=True)]


def is_free(each: Vibration) -> bool:
    """Return True if a vibration decays; one that a load keeps up does not."""
    return each.damping > DECAYS * each.damping_sigma


def _refined(times: Array, x: Array, rates: np.ndarray) -> tuple[np.ndarray, Array]:
    """A Gauss-Newton step (1/s) of every rate to least squares (modes,), and deviations of its two parts (modes, 2)."""
    waves = np.exp(rates[None, :] * times[:, None])
    linear = np.hstack([waves.real, -waves.imag, np.ones((len(times), 1))])
    amplitudes = np.linalg.lstsq(linear, x, rcond=None)[0]
    rest = x - linear @ amplitudes
    noise = float(np.square(rest).sum() / max(x.size - linear.shape[1] * x.shape[1] - 2 * len(rates), 1))
    complexes = amplitudes[: len(rates)] + 1j * amplitudes[len(rates) : 2 * len(rates)]
    slopes = times[:, None, None] * waves[:, :, None] * complexes[None]
    by_rates = np.concatenate([slopes.real, -slopes.imag], axis=1)
    # what amplitudes can make up for is no information on rates
    basis = np.linalg.qr(linear)[0]
    flat = by_rates.reshape(len(times), -1)
    left = (flat - basis @ (basis.T @ flat)).reshape(by_rates.shape)
    information = np.tensordot(left, left, axes=((0, 2), (0, 2)))
    inverse = np.linalg.pinv(information, hermitian=True)
    step = (inverse @ np.tensordot(left, rest, axes=((0, 2), (0, 1)))).reshape(2, -1)
    sigmas = np.sqrt(np.maximum(noise * np.diag(inverse), 0.0)).reshape(2, -1).T * _coloured(times, rest, rates)[:, None]
    return step[0] + 1j * step[1], sigmas


def _coloured(times: Array, rest: Array, rates: np.ndarray) -> Array:
    """Root of the spectrum of `rest` (k, c) near every rate (modes,), 1 where it is as elsewhere; at least that."""
    neighbourhood = 3.0  # resolutions: the residual so near to a frequency counts for its deviation
    power = np.square(np.abs(np.fft.rfft(rest, axis=0)[1:])).sum(axis=1)
    lines = np.arange(1.0, len(power) + 1.0)  # of the length of the record
    length = len(times) * (times[1] - times[0])
    near = np.abs(lines - length * np.abs(rates)[:, None] / (2.0 * pi)) < neighbourhood
    usual = max(float(power.mean()), 1e-300)
    return np.asarray(np.sqrt(np.maximum(near @ power / np.maximum(near.sum(axis=1), 1) / usual, 1.0)))


def _vibration(rate: complex, sigmas: Array) -> Vibration:
    size, (decay_sigma, turn_sigma) = float(abs(rate)), sigmas.tolist()
    damping, damping_sigma = float(-rate.real) / size, decay_sigma / size
    return Vibration(size / (2.0 * pi), turn_sigma / (2.0 * pi), damping, damping_sigma)
