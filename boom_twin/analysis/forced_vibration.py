"""Natural frequencies of a boom that a pump or the wind keeps shaking, from samples of one sensor's direction at even times.

The samples are one draw of a Gaussian process. Each mode is an oscillator: what a move left of it decays, what a broad random
force keeps up of it is stationary. A pump's lines (its strokes and their harmonics) and the mean may have any size, so that
they tell nothing; gusts below the modes are a first-order Gauss-Markov process, and the rest is white. Maximum likelihood by
Fisher scoring gives the parameters, and Fisher's information (Kay 1993, Fundamentals of Statistical Signal Processing, section
3.9) how sure each of them is: a short record, a strong pump or a mode that nothing excites is told by its deviation.
"""

from __future__ import annotations

from collections.abc import Generator
from math import log, pi

import numpy as np

from ..types import Array
from .free_vibration import Vibration

STROKES = np.linspace(0.15, 0.7, 221)  # Hz, of a pump, that are looked through
FINE = (0.003, 0.0012, 0.0003)  # Hz, about the best of them
HARMONICS = 15  # of these, by which a pump is found
UNUSED, CLEAR = 0.15, 8.0  # ln that a line of noise gains on average; and by how much more probable than none a pump must be
SHIFT, UNSURE_PUMP = 1e-5, 1e-2  # relative: of a pump's frequency, for a derivative; by which it may be wrong
ANY_SIZE = 1e4  # times the variance of the samples
GUSTS = 0.1  # Hz, corner frequency of what is below the modes
USUAL_DAMPING, DAMPING_SPREAD = 0.012, 0.8  # ratio, and deviation of its logarithm, before anything is measured
NEAR = 0.08  # likewise, of a frequency's logarithm about the model's
FREE = 4.0  # likewise, of the logarithm of a variance
ROUNDS = 5, 9  # steps of Fisher scoring, between which the pump is looked for anew
CALM, LONGEST_STEP, LONGEST_SHIFT = 0.1, 0.7, 0.02  # a last step, in deviations; longest ones, of a frequency and of others
ODD = 8.0  # power of the strongest line over the mean, that white noise exceeds in one record of twenty
EACH = 4  # parameters of a mode: frequency, damping, variance that is kept up, variance that decays


def forced_vibrations(dt: float, values: Array, guesses: Array) -> Generator[None, None, list[Vibration]]:
    """Modes near `guesses` (m,) in Hz, one for each, in `values` (k,), `dt` (s) apart; yields after every millisecond or so.

    None at all where the search does not come to rest, or what the parts above leave of the samples is not white. What is known
    before is a normal distribution about a guess: a mode that is not seen has that one's deviation, `NEAR`. Guesses are to
    hold all modes that are in `values`.
    """
    x = np.asarray(values, np.float64) - values.mean()
    x /= x.std()
    times = dt * np.arange(float(len(x)))
    start = [(log(2.0 * pi * _peak(times, x, guess)), log(USUAL_DAMPING), log(0.1), log(0.1)) for guess in guesses]
    theta = np.array([*np.ravel(start), log(0.01), log(0.001)])
    mean = theta.copy()
    mean[: EACH * len(guesses) : EACH] = np.log(2.0 * pi * guesses)
    spread = np.array([NEAR, DAMPING_SPREAD, FREE, FREE] * len(guesses) + [FREE, FREE])
    by_frequency = slice(0, EACH * len(guesses), EACH)
    longest = np.full(len(theta), LONGEST_STEP)
    longest[by_frequency] = LONGEST_SHIFT
    covariance, pump = np.diag(spread**2), 0.0
    is_found, odd = False, ODD
    for steps in ROUNDS:
        white = np.linalg.inv(np.linalg.cholesky(_covariances(times, theta)[0]))
        pump = yield from _pump(times, white, white @ x, pump)
        lines = _lines(times, pump, 0.5 / dt)
        amplitudes = np.linalg.lstsq(white @ lines, white @ x, rcond=None)[0]
        rest = x - lines @ amplitudes
        fixed = ANY_SIZE * lines @ lines.T
        if pump:
            later = (_lines(times, pump * (1.0 + SHIFT), 0.5 / dt) - lines) @ amplitudes / SHIFT
            fixed += UNSURE_PUMP**2 * np.outer(later, later)
        for _ in range(steps):
            whole, parts = _covariances(times, theta)
            root = np.linalg.inv(np.linalg.cholesky(fixed + whole))
            precise = root.T @ root
            weighted = precise @ rest
            yield
            turned, score = np.empty((len(theta), len(x), len(x))), np.empty(len(theta))
            for i, part in enumerate(parts):
                turned[i] = precise @ part
                score[i] = 0.5 * (weighted @ part @ weighted - np.trace(turned[i]))
                yield
            flat, back = turned.reshape(len(theta), -1), turned.transpose(0, 2, 1).reshape(len(theta), -1)
            covariance = np.linalg.inv(0.5 * flat @ back.T + np.diag(spread**-2))
            step = covariance @ (score - (theta - mean) / spread**2)
            theta = theta + step * min(1.0, 1.0 / float((np.abs(step) / longest).max()))
            is_found = bool((np.abs(step[by_frequency]) < CALM * np.sqrt(np.diag(covariance))[by_frequency]).all())
            odd = _oddness(root @ rest)
            yield
    if not is_found or odd > ODD:
        return []
    sigmas, found = np.sqrt(np.diag(covariance)), []
    for k in range(0, EACH * len(guesses), EACH):
        frequency, damping = np.exp(theta[k]) / (2.0 * pi), np.exp(theta[k + 1])
        found.append(Vibration(*(float(each) for each in (frequency, frequency * sigmas[k], damping, damping * sigmas[k + 1]))))
    return found


def _covariances(times: Array, theta: Array) -> tuple[Array, Array]:
    """Covariance (k, k) of what is no line, and its derivatives by the parameters (p, k, k)."""
    apart, sum_ = np.abs(times[:, None] - times[None]), times[:, None] + times[None]
    parts = []
    for omega, damping, kept, free in np.exp(theta[:-2]).reshape(-1, EACH):
        decay, turn = damping * omega, omega * np.sqrt(1.0 - damping**2)
        cosine, sine = np.cos(turn * apart), np.sin(turn * apart)
        still, left = kept * np.exp(-decay * apart), free * np.exp(-decay * sum_)
        slower = (still * apart + left * sum_) * cosine * decay
        parts += [-slower - (still + left) * sine * turn * apart, -slower, still * cosine, left * cosine]
    gusts, noise = np.exp(theta[-2]) * np.exp(-2.0 * pi * GUSTS * apart), np.exp(theta[-1]) * np.eye(len(times))
    whole = sum(parts[2::EACH], np.zeros_like(apart)) + sum(parts[3::EACH], np.zeros_like(apart)) + gusts + noise
    return whole, np.array([*parts, gusts, noise])


def _oddness(white: Array) -> float:
    """Strongest line of whitened samples, in what white noise has on average."""
    power = np.abs(np.fft.rfft(white, 4 * len(white))) ** 2
    return float(power.max() / len(white))


def _lines(times: Array, pump: float, highest: float) -> Array:
    """A constant, and cosine and sine of every harmonic of a pump below `highest` (Hz), shape (k, lines)."""
    turns = 2.0 * pi * pump * np.arange(1.0, highest / pump if pump else 1.0)[None] * times[:, None]
    return np.hstack([np.ones((len(times), 1)), np.cos(turns), np.sin(turns)])


def _pump(times: Array, white: Array, x: Array, before: float) -> Generator[None, None, float]:
    """Strokes a second of the pump that makes whitened samples most probable; 0 if that is no pump at all.

    `white` whitens what is no line; `before` is what was found for another one.
    """

    def evidence(pump: float) -> float:
        lines = white @ _lines(times, pump, min((HARMONICS + 0.5) * pump, 0.45 / times[1]))
        pairs = lines[:, 1:].reshape(len(x), 2, -1).transpose(0, 2, 1).reshape(len(x), -1)  # both of a harmonic together
        seen = np.square(np.linalg.qr(np.column_stack([lines[:, 0], pairs]))[0].T[1:] @ x).reshape(-1, 2).sum(axis=1) / 2.0
        seen = np.maximum(seen, 1.0)
        return float((seen - 1.0 - np.log(seen) - UNUSED).sum())

    grid, best, most = (STROKES if not before else before + np.linspace(-FINE[0], FINE[0], 13)), before, 0.0
    for width in (*FINE, 0.0):
        scores = []
        for pump in grid.tolist():
            scores.append(evidence(pump))
            if len(scores) % 3 == 0:
                yield
        best, most = float(grid[int(np.argmax(scores))]), max(scores)
        grid = best + np.linspace(-width, width, 13)
    return best if most > CLEAR else 0.0


def _peak(times: Array, x: Array, guess: float) -> float:
    """Frequency (Hz) near a guess at which `x` is strongest."""
    grid = guess * np.linspace(0.88, 1.12, 49)
    power = np.abs(np.exp(-2j * pi * grid[:, None] * times[None]) @ (x * np.hanning(len(x)))) ** 2
    return float(grid[int(np.argmax(power * np.exp(-0.5 * (np.log(grid / guess) / NEAR) ** 2)))])
