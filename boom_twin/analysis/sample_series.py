"""Series of samples: breaks and spacing of their times, power spectral density, running statistics, free vibration.

Free vibration is identified by ERA (Juang and Pappa 1985, doi 10.2514/3.20031). The samples of all channels at even times are
stacked into Hankel matrices. Rows shifted by one sample span the same signal space, turned by exp(lambda dt) for each mode.
Amplitudes follow by least squares, and a Gauss-Newton step refines the rates. Standard deviations come from the covariance of
all parameters, for white noise as large as the residual. Where the residual is larger near a frequency, that residual counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from ..types import Array

BREAK = 1.0  # step of time, s, that is not bridged; neither is a step back
SEGMENT = 8.0  # of Welch's method, s; lines of a spectrum are 1/SEGMENT apart


def unbroken(times: Array) -> list[slice]:
    """Return the parts of `times` (n,) in s that have no break; the memory of even times goes by samples in each."""
    steps = np.diff(times)
    cuts = (np.flatnonzero((steps < 0.0) | (steps > BREAK)) + 1).tolist()
    return [slice(first, stop) for first, stop in zip([0, *cuts], [*cuts, len(times)], strict=True)]


def spacing(times: Array) -> float:
    """Return the usual distance of ascending `times` (n,) in s: their median, at least half the mean."""
    return max(float(np.median(np.diff(times))), 0.5 * float(times[-1] - times[0]) / (len(times) - 1))


def power_density(values: Array, interval: float, segment: int) -> tuple[Array, Array, int]:
    """Return frequencies (lines,), one-sided power spectral density (lines,) or (lines, c) per Hz, and number of segments.

    Welch's method: Hann window, half overlap, means removed, `segment` values a segment of `values` (k,) or (k, c) at even
    times, `interval` s apart. ``scipy.signal.welch`` gives the same, but takes half a second to import.
    """
    parts = np.lib.stride_tricks.sliding_window_view(values, segment, axis=0)[:: segment - segment // 2]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(segment) / segment)
    lines = np.fft.rfft(window * (parts - parts.mean(axis=-1, keepdims=True)), axis=-1)
    power = 2.0 * interval * np.square(np.abs(lines)).mean(axis=0) / np.square(window).sum()
    power[..., 0] *= 0.5
    if segment % 2 == 0:
        power[..., -1] *= 0.5  # these two lines have no twin at a negative frequency
    return np.asarray(np.fft.rfftfreq(segment, interval)), np.asarray(power.T), len(parts)


class ColumnStatistics:
    """Mean, standard deviation and root mean square of all finite values of each column so far; `count` is their number.

    Parts are combined as by Chan et al. 1983, doi 10.1080/00031305.1983.10483115.
    """

    def __init__(self, columns: int) -> None:
        self.count: NDArray[np.int64] = np.zeros(columns, np.int64)
        self._mean, self._about_mean, self._squares = np.zeros((3, columns))

    def add(self, values: Array) -> None:
        """Take rows in, shape (k, columns); NaN is no value."""
        known = np.isfinite(values)
        own = known.sum(axis=0)
        total, number = self.count + own, np.maximum(own, 1)
        given = np.where(known, values, 0.0)
        mean = given.sum(axis=0) / number
        apart = np.where(own > 0, mean - self._mean, 0.0)
        about = np.where(known, values - mean, 0.0)
        shares = own / np.maximum(total, 1)
        self._about_mean += (about**2).sum(axis=0) + apart**2 * self.count * shares
        self._mean += apart * shares
        self._squares += (given**2).sum(axis=0)
        self.count = total

    @property
    def mean(self) -> list[float | None]:
        """Means; None where there is no value, as in the other statistics."""
        return self._told(self._mean)

    @property
    def deviation(self) -> list[float | None]:
        """Standard deviations, of the population."""
        return self._told(np.sqrt(self._about_mean / np.maximum(self.count, 1)))

    @property
    def rms(self) -> list[float | None]:
        """Root mean squares."""
        return self._told(np.sqrt(self._squares / np.maximum(self.count, 1)))

    def _told(self, found: Array) -> list[float | None]:
        return [float(value) if count else None for value, count in zip(found, self.count, strict=True)]


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
