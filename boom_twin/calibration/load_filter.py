"""Kalman filter of residuals under an unknown load at the tip: their innovations, which are white whatever the load was.

States, SI: the load's x and y, a Gauss-Markov process of correlation time `LOAD_TIME`; a load that stays, x and y; for every
stroke the error of its smoothed reading and that error's rate, a process of second order with the smoother's corner; then q and
q' of the reduced model (`boom_twin.calibration.load_modes`). The load drives the modes at the tip, errors of strokes drive them
by the cylinders' forces, and turn the joints.

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

from ..estimation.sensor_model import specific_force
from ..kernels.jit import kernel
from ..types import Array
from .load_modes import ModesAlong
from .sessions import SessionCourse

LOAD_TIME = 1.0  # s
CONSTANT_TIME = 1000.0  # s; the load that stays is a Gauss-Markov process, too
CONSTANT = 2.0  # its standard deviation over that of the load
CORNER = 0.786  # of a second-order filter over that of the strokes' smoother, at which both pass the same variance of noise
STROKES = 4  # first place of the strokes' errors


class LoadPrior(NamedTuple):
    """What is taken to be known of the load: its standard deviation, N, and variance that it gains at each of b blocks, N^2."""

    level: float
    jumps: Array


class StrokeError(NamedTuple):
    """Noise of the smoothed strokes: power spectral density, m^2 s, and corner of the smoother, rad/s."""

    density: float
    corner: float


def stroke_error(variance: float, course: SessionCourse) -> StrokeError:
    """Of strokes measured with `variance` (m^2) and smoothed as in `course`."""
    return StrokeError(variance * course.interval, CORNER * 2.0 * math.pi * course.corner)


class FilterModel(NamedTuple):
    """Matrices of k postures, s states, c channels: `turn`, `drive` (k, s, s) of a step, `read` (k, c, s), `start` (s, s)."""

    turn: Array
    drive: Array
    read: Array
    start: Array


class Innovations(NamedTuple):
    """Of b blocks, j columns, c channels: `values` (b, j, c), `variances` (b, c); and the load (b, 2), N, by column 0."""

    values: Array
    variances: Array
    loads: Array


def filter_model(
    modes: ModesAlong, boom: int, gravity: Array, channels: NDArray[np.int64], strokes: StrokeError, level: float, step: float
) -> FilterModel:
    """The filter of boom number `boom` of `modes`, for blocks of `step` (s), which begins in the long run of its processes.

    Parameters
    ----------
    gravity : ndarray, shape (2,)
        m/s^2.
    channels : ndarray of int, shape (c,)
        Which of joint angles (n) and the IMU's x and z are read.
    level : float
        Standard deviation of the load, N.
    """
    rates = _rates(modes, boom, strokes.corner)
    n, size = modes.slopes.shape[1], rates.shape[1]
    density = np.zeros(size)
    density[:2] = 2.0 * level**2 / LOAD_TIME
    density[2:STROKES] = 2.0 * (CONSTANT * level) ** 2 / CONSTANT_TIME
    density[STROKES + n : STROKES + 2 * n] = strokes.density * strokes.corner**4
    half = expm(0.5 * step * rates)
    turn = half @ half
    drive = step / 6.0 * (np.diag(density) + 4.0 * _carried(half, density) + _carried(turn, density))
    start = solve_discrete_lyapunov(turn[0], drive[0])
    return FilterModel(turn, drive, _readings(modes, boom, gravity, rates)[:, channels].copy(), 0.5 * (start + start.T))


def _carried(turn: Array, density: Array) -> Array:
    return np.asarray((turn * density) @ turn.swapaxes(1, 2))


def _rates(modes: ModesAlong, boom: int, corner: float) -> Array:
    """The states' derivatives by the states, shape (k, s, s)."""
    k, _, m, n = modes.forces.shape
    size = STROKES + 2 * n + 2 * m
    a, inverse = np.zeros((k, size, size)), np.linalg.inv(modes.mass[:, boom])
    error, slip, q, rate = _places(n, m)
    a[:, [0, 1], [0, 1]] = -1.0 / LOAD_TIME
    a[:, [2, 3], [2, 3]] = -1.0 / CONSTANT_TIME
    a[:, error, slip] = 1.0
    a[:, slip, error] = -(corner**2)
    a[:, slip, slip] = -math.sqrt(2.0) * corner
    a[:, q, rate] = 1.0
    first, last = rate[0], rate[-1] + 1
    a[:, first:last, q[0] : first] = -inverse @ modes.stiffness[:, boom]
    a[:, first:last, first:last] = -inverse @ modes.damping[:, boom]
    a[:, first:last, 0:2] = a[:, first:last, 2:STROKES] = inverse @ modes.tip[..., :2]
    a[:, first:last, STROKES : STROKES + n] = inverse @ modes.forces[:, boom]
    return a


def _places(n: int, m: int) -> tuple[NDArray[np.int64], ...]:
    """Of the strokes' errors, their rates, q and q'."""
    bounds = STROKES + np.array([0, n, 2 * n, 2 * n + m, 2 * n + 2 * m])
    return tuple(np.arange(a, b) for a, b in pairwise(bounds))


def _readings(modes: ModesAlong, boom: int, gravity: Array, rates: Array) -> Array:
    """How joint angles and the IMU read the states, shape (k, n + 2, s)."""
    k, _, m, n = modes.forces.shape
    error, _, q, rate = _places(n, m)
    joints = modes.joints.swapaxes(1, 2)
    read = np.zeros((k, n + 2, rates.shape[1]))
    read[:, :n, q[0] : rate[0]] = joints
    read[:, :n, 0:2] = read[:, :n, 2:STROKES] = modes.follow
    read[:, :n, STROKES : STROKES + n] = -joints @ np.linalg.solve(modes.stiffness[:, boom], modes.forces[:, boom])
    read[:, np.arange(n), error] += 1.0 / modes.slopes  # at rest a stroke turns its own joint, and no other
    swing = modes.tip[..., :2].swapaxes(1, 2) @ rates[:, rate[0] :]
    c, s = np.cos(modes.heading)[:, None], np.sin(modes.heading)[:, None]
    read[:, n], read[:, n + 1] = specific_force(swing[:, 0], swing[:, 1], c, s)
    along_x, along_z = specific_force(-gravity[0], -gravity[1], c, s)
    read[:, n, q[0] : rate[0]] += along_z * modes.tip[..., 2]
    read[:, n + 1, q[0] : rate[0]] -= along_x * modes.tip[..., 2]
    return read


def innovations(model: FilterModel, places: NDArray[np.int64], noise: Array, prior: LoadPrior, residuals: Array) -> Innovations:
    """Run the filter over residuals of b blocks, shape (b, j, c).

    Parameters
    ----------
    places : ndarray of int, shape (b,)
        Number of the posture of each block.
    noise : ndarray, shape (b, c)
        Variances of the means over blocks.
    """
    count, columns, channels = residuals.shape
    size = len(model.start)
    found = Innovations(np.zeros(residuals.shape), np.ones((count, channels)), np.zeros((count, 2)))
    x, p, scratch = np.zeros((size, columns)), model.start.copy(), np.zeros((size + 1, size))
    run_filter(places, model.turn, model.drive, model.read, noise, prior.jumps, x, p, residuals, *found, scratch)
    return found


@kernel
def run_filter(
    places: NDArray[np.int64], turn: Array, drive: Array, read: Array, noise: Array, jumps: Array, x: Array, p: Array,
    residuals: Array, values: Array, variances: Array, loads: Array, scratch: Array,
) -> None:  # fmt: skip
    """See `innovations`; x (s, j), p (s, s) state and covariance, scratch (s + 1, s). NaN in column 0: not measured."""
    size, columns = x.shape
    g, w = scratch[size], scratch
    for t in range(residuals.shape[0]):
        a, q, h = turn[places[t]], drive[places[t]], read[places[t]]
        for b in range(2):
            p[b, b] += jumps[t]
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
                total = q[i, k]
                for b in range(size):
                    total += w[i, b] * a[k, b]
                p[i, k] = total
                p[k, i] = total
        for c in range(residuals.shape[2]):
            if not math.isfinite(residuals[t, 0, c]):
                continue
            spread = noise[t, c]
            for i in range(size):
                g[i] = 0.0
                for k in range(size):
                    g[i] += p[i, k] * h[c, k]
                spread += h[c, i] * g[i]
            variances[t, c] = spread
            for k in range(columns):
                off = residuals[t, k, c]
                for i in range(size):
                    off -= h[c, i] * x[i, k]
                values[t, k, c] = off
                for i in range(size):
                    x[i, k] += g[i] / spread * off
            for i in range(size):
                for k in range(size):
                    p[i, k] -= g[i] / spread * g[k]
        for b in range(2):
            loads[t, b] = x[b, 0] + x[b + 2, 0]
