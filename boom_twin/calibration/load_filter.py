"""Kalman filter of residuals under an unknown load at the tip: its innovations are white for any load.

States, SI: the load's x and y, a Gauss-Markov process of correlation time `LOAD_TIME`; a load that stays but where it jumps, x
and y; for every stroke the error of its smoothed reading, white noise through the smoother twice; then q and q' of the reduced
model (`boom_twin.calibration.load_modes`). The load drives the modes at the tip, errors of strokes drive them by the cylinders'
forces, and turn the joints.

The same gains serve several columns of residuals, so that sensitivities by zeros of sensors cost little (Willsky and Jones
1976).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_lyapunov

from ..deviation.sensor_model import specific_force
from ..kernels.jit import kernel
from ..types import Array
from .load_modes import ModesAlong
from .sessions import SessionCourse

LOAD_TIME = 5.0  # s
CONSTANT_TIME = 1e6  # s; the load that stays is a Gauss-Markov process, too, that hardly moves by itself
BUTTERWORTH = (1.0, 2.0, 2.0)  # coefficients of his polynomial of third order, from the constant on
ORDER = len(BUTTERWORTH)  # of the smoother of strokes, which runs forth and back: what noise it leaves has twice as many states
STROKES = 4  # first place of the strokes' errors


class LoadPrior(NamedTuple):
    """Prior of the unknown load.

    `rates` (2,), N^2/s: variance that its x and y gain in a second; `constant`, N: standard deviation of the part that stays;
    `jumps` (b, 2), N^2: variance that x and y of this part gain in each of b blocks; 0 for none.
    """

    rates: Array
    constant: float
    jumps: Array | float = 0.0


class StrokeError(NamedTuple):
    """Noise of the strokes: its power spectral density, m^2 s, and corner of the smoother that it goes through, rad/s."""

    density: float
    corner: float


def stroke_error(variance: float, course: SessionCourse) -> StrokeError:
    """Return the noise of strokes measured with `variance` (m^2) and smoothed as in `course`."""
    return StrokeError(variance * course.interval, 2.0 * math.pi * course.corner)


class FilterModel(NamedTuple):
    """Matrices of k postures, s states, c channels.

    `turn`, `drive` (k, s, s) of a step; `read` (k, c, s), and what it gains, beyond each, where a posture is passed in a
    second, `passing` (k, c, s), s; `tilt` (k, s), angle of the tip, rad; `start` (s, s).
    """

    turn: Array
    drive: Array
    read: Array
    passing: Array
    tilt: Array
    start: Array


class Innovations(NamedTuple):
    """Innovations of b blocks, j columns, c channels.

    `values` are (b, j, c), `variances` (b, c), and `loads` (b, 2) the load, N, by column 0.
    """

    values: Array
    variances: Array
    loads: Array


def filter_model(modes: ModesAlong, channels: NDArray[np.int64], corner: float, prior: LoadPrior, step: float) -> FilterModel:
    """Return the filter for blocks of `step` (s); it begins in the stationary state of its processes.

    Parameters
    ----------
    channels : ndarray of int, shape (c,)
        Which of joint angles (n) and the IMU's x and z are read.
    corner : float
        Of the strokes' errors, rad/s; what drives them is not in `drive`.
    """
    rates = _rates(modes, corner)
    density = np.zeros(rates.shape[1])
    density[:2] = prior.rates
    density[2:STROKES] = 2.0 * prior.constant**2 / CONSTANT_TIME
    half = expm(0.5 * step * rates)
    turn = half @ half
    drive = step / 6.0 * (np.diag(density) + 4.0 * _carried(half, density) + _carried(turn, density))
    start = solve_discrete_lyapunov(turn[0], drive[0])
    tilt = np.zeros(rates.shape[:2])
    first = STROKES + 2 * ORDER * modes.slopes.shape[1]
    tilt[:, first : first + modes.tip.shape[1]] = modes.tip[..., 2]
    read, passing = _readings(modes, rates)[:, channels].copy(), _passing(modes, rates.shape[1])[:, channels].copy()
    return FilterModel(turn, drive, read, passing, tilt, 0.5 * (start + start.T))


def _carried(turn: Array, density: Array) -> Array:
    return np.asarray((turn * density) @ turn.swapaxes(1, 2))


def _rates(modes: ModesAlong, corner: float) -> Array:
    """Return the derivatives of the states by the states, shape (k, s, s)."""
    k, m, n = modes.forces.shape
    size = STROKES + 2 * ORDER * n + 2 * m
    a = np.zeros((k, size, size))
    errors, q, rate = _places(n, m)
    a[:, [0, 1], [0, 1]] = -1.0 / LOAD_TIME
    a[:, [2, 3], [2, 3]] = -1.0 / CONSTANT_TIME
    for before, after in pairwise(errors):
        a[:, before, after] = corner
    for last, group in ((errors[ORDER - 1], errors[:ORDER]), (errors[-1], errors[ORDER:])):
        for place, share in zip(group, BUTTERWORTH, strict=True):
            a[:, last, place] = -share * corner
    a[:, q, rate] = 1.0
    first, last = rate[0], rate[-1] + 1
    a[:, first:last, q[0] : first] = -modes.stiffness
    a[:, first:last, first:last] = -modes.damping
    a[:, first:last, 0:2] = a[:, first:last, 2:STROKES] = modes.tip[..., :2]
    a[:, first:last, STROKES : STROKES + n] = modes.forces
    return a


def _places(n: int, m: int) -> tuple[NDArray[np.int64], ...]:
    """Return the places of the strokes' errors with their driving states (2 ORDER, n), of q and of q'."""
    first = STROKES + 2 * ORDER * n
    return np.arange(STROKES, first).reshape(-1, n), np.arange(first, first + m), np.arange(first + m, first + 2 * m)


def _readings(modes: ModesAlong, rates: Array) -> Array:
    """Return the measurement matrix of joint angles and IMU, shape (k, n + 2, s), without the rotation of the IMU."""
    k, m, n = modes.forces.shape
    errors, q, rate = _places(n, m)
    joints = modes.joints.swapaxes(1, 2)
    read = np.zeros((k, n + 2, rates.shape[1]))
    read[:, :n, q[0] : rate[0]] = joints
    read[:, :n, 0:2] = read[:, :n, 2:STROKES] = modes.follow
    read[:, :n, STROKES : STROKES + n] = -joints @ np.linalg.solve(modes.stiffness, modes.forces)
    read[:, np.arange(n), errors[0]] += 1.0 / modes.slopes  # at rest a stroke turns its own joint, and no other
    swing = modes.tip[..., :2].swapaxes(1, 2) @ rates[:, rate[0] :]
    c, s = np.cos(modes.heading)[:, None], np.sin(modes.heading)[:, None]
    read[:, n], read[:, n + 1] = specific_force(swing[:, 0], swing[:, 1], c, s)
    return read


def _passing(modes: ModesAlong, size: int) -> Array:
    """Return the measurement matrix of the IMU for changing mode shapes, per knot passed in a second, (k, n + 2, s), s.

    It is the term 2 Psi' q' of the tip's acceleration Psi q'' + 2 Psi' q' + ...
    """
    k, m, n = modes.forces.shape
    rate = _places(n, m)[2]
    found, middle = np.zeros((k, n + 2, size)), 0.5 * (modes.heading[1:] + modes.heading[:-1])
    change = 2.0 * np.diff(modes.tip[..., :2], axis=0)
    force = specific_force(change[..., 0], change[..., 1], np.cos(middle)[:, None], np.sin(middle)[:, None])
    found[:-1, n:, rate[0] : rate[-1] + 1] = np.stack(force, axis=1)
    return found


def tilted(measured: Array, joints: int) -> Array:
    """Return the change of joint angle and IMU readings (b, n + 2) per radian of tip rotation.

    The IMU of a rotated tip reads gravity and the tip's acceleration, load included, along other axes. So its change follows
    from the measured readings (b, n + 2).
    """
    found = np.zeros(measured.shape)
    if measured.shape[1] > joints:
        found[:, joints], found[:, joints + 1] = measured[:, joints + 1], -measured[:, joints]
    return np.nan_to_num(found)


def innovations(
    model: FilterModel, places: Array, paces: Array, noise: Array, gained: Array, tilts: Array, residuals: Array
) -> Innovations:
    """Run the filter over residuals of b blocks, shape (b, j, c).

    Parameters
    ----------
    places, paces : ndarray, shape (b,)
        Where among the postures each block is, from 0 to k - 1, and how many it passes in a second.
    noise : ndarray, shape (b, c)
        Variances of the means over blocks.
    gained : ndarray, shape (b, s)
        Variance that each state gains in every block, beyond that of the model: see `gained_variance`.
    tilts : ndarray, shape (b, c)
        See `tilted`.
    """
    count, columns, channels = residuals.shape
    size = len(model.start)
    found = Innovations(np.zeros(residuals.shape), np.ones((count, channels)), np.zeros((count, 2)))
    x, p, scratch = np.zeros((size, columns)), model.start.copy(), np.zeros((2 * size + 2, size))
    run_filter(places, paces, *model[:-1], noise, gained, tilts, x, p, residuals, *found, scratch)
    return found


def gained_variance(model: FilterModel, prior: LoadPrior, strokes: StrokeError, moving: Array, step: float) -> Array:
    """Return the variance (b, s) that states gain in each of b blocks of `step` (s).

    The load gains variance where it jumps, strokes gain it where they move. `moving` (b, n) is the share of their noise that is
    left in the strokes, see `SessionCourse`.
    """
    n, found = moving.shape[1], np.zeros((len(moving), len(model.start)))
    found[:, 2:STROKES] = prior.jumps
    last = STROKES + 2 * ORDER * n
    found[:, last - n : last] = step * strokes.density * strokes.corner**2 * moving**2
    return found


@kernel
def run_filter(
    places: Array, paces: Array, turn: Array, drive: Array, read: Array, passing: Array, tilt: Array,
    noise: Array, gained: Array, tilts: Array, x: Array, p: Array,
    residuals: Array, values: Array, variances: Array, loads: Array, scratch: Array,
) -> None:  # fmt: skip
    """See `innovations`; x (s, j), p (s, s) state and covariance, scratch (2 s + 2, s). NaN in column 0: not measured."""
    size, columns = x.shape
    g, h, a, w = scratch[2 * size], scratch[2 * size + 1], scratch[size : 2 * size], scratch
    for t in range(residuals.shape[0]):
        left = max(0, min(int(places[t]), turn.shape[0] - 2))
        right, far = left + 1, places[t] - left
        near = 1.0 - far
        for i in range(size):
            for k in range(size):
                a[i, k] = near * turn[left, i, k] + far * turn[right, i, k]
        for b in range(size):
            p[b, b] += gained[t, b]
        for k in range(columns):
            for i in range(size):
                g[i] = 0.0
                for b in range(size):
                    g[i] += a[i, b] * x[b, k]
            for i in range(size):
                x[i, k] = g[i]
        for i in range(size):
            for k in range(size):
                w[i, k] = 0.0
            for b in range(size):
                if a[i, b] != 0.0:
                    for k in range(size):
                        w[i, k] += a[i, b] * p[b, k]
        for i in range(size):
            for k in range(i + 1):
                p[i, k] = near * drive[left, i, k] + far * drive[right, i, k]
        for k in range(size):
            for b in range(size):
                if a[k, b] != 0.0:
                    for i in range(k, size):
                        p[i, k] += w[i, b] * a[k, b]
            for i in range(k + 1, size):
                p[k, i] = p[i, k]
        for c in range(residuals.shape[2]):
            if not math.isfinite(residuals[t, 0, c]):
                continue
            for i in range(size):
                turned = near * tilt[left, i] + far * tilt[right, i]
                h[i] = near * read[left, c, i] + far * read[right, c, i] + paces[t] * passing[left, c, i] + tilts[t, c] * turned
            spread = noise[t, c]
            for i in range(size):
                g[i] = 0.0
                for k in range(size):
                    g[i] += p[i, k] * h[k]
                spread += h[i] * g[i]
            variances[t, c] = spread
            for k in range(columns):
                off = residuals[t, k, c]
                for i in range(size):
                    off -= h[i] * x[i, k]
                values[t, k, c] = off
                for i in range(size):
                    x[i, k] += g[i] / spread * off
            for i in range(size):
                for k in range(size):
                    p[i, k] -= g[i] / spread * g[k]
        for b in range(2):
            loads[t, b] = x[b, 0] + x[b + 2, 0]
