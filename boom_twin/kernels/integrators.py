"""Generalised-alpha and Newmark: acceleration and velocity of a scalar as affine functions of its new position.

    a' = A (x' - x_hat),   v' = C x' + D,   x_hat and D linear in the scalar's history.

A prime marks the end of the step. A history is a column of x, v, p, a (X, V, P, A). Generalised-alpha (Chung and Hulbert 1993;
with the auxiliary acceleration p of [AB] in `boom_twin.kernels`) is

    x' = x + h v + h^2 ((1/2 - beta) p + beta p'),   v' = v + h ((1 - gamma) p + gamma p'),
    (1 - am) p' + am p = (1 - af) a' + af a;

rho is the spectral radius at infinite frequency: 1 keeps every frequency, 0 kills the highest within one step. Positions of
constrained points are integrated directly (index 3), which needs rho < 1. Newmark is am = af = 0, beta = (gamma + 1/2)^2/4.
`REST` has A = C = 0 (statics) and writes a history without motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..types import Array
from .jit import inner

GENERALISED_ALPHA, NEWMARK, REST = range(3)
X, V, P, A = -4, -3, -2, -1  # rows of a history, and columns of weights, from their ends
NEW_A, OLD = 0, 1  # columns of weights: new a', then the old history
HAT, OFFSET, AUXILIARY = range(3)  # rows of weights: x_hat, D, new p'
DEPTH = 4


class Scheme(NamedTuple):
    """One scheme at one step size; `family` and `parameter` are arguments of `prepare`."""

    family: np.int64
    parameter: float
    reach: float  # step size, s; 0 for `REST`
    gain: float  # A, 1/s^2
    rate: float  # C, 1/s
    weights: Array  # (3, 1 + DEPTH), see the module's constants


def new_weights() -> Array:
    """Return an array for a scheme's weights."""
    return np.zeros((3, OLD + DEPTH))


@inner
def prepare(family, parameter, step, weights):
    """Return the scheme of `family` for `step` (s). `parameter` is rho, or Newmark's gamma. Fills `weights`."""
    family = np.int64(family)
    if family == REST:
        for k in range(weights.shape[0]):
            for j in range(weights.shape[1]):
                weights[k, j] = 0.0
        return Scheme(family, parameter, 0.0, 0.0, 0.0, weights)
    am, af, gamma, h = 0.0, 0.0, parameter, step
    if family == GENERALISED_ALPHA:
        am, af = (2.0 * parameter - 1.0) / (parameter + 1.0), parameter / (parameter + 1.0)
        gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    gain, rate = (1.0 - am) / ((1.0 - af) * beta * h * h), gamma / (beta * h)
    share = 1.0 / ((1.0 - af) * gain)
    weights[HAT, X], weights[HAT, V] = 1.0, h
    weights[HAT, P], weights[HAT, A] = h * h * (0.5 - beta) - am * share, af * share
    weights[OFFSET, X], weights[OFFSET, V] = -rate, 1.0 - rate * h
    weights[OFFSET, P], weights[OFFSET, A] = h * (1.0 - gamma) - rate * h * h * (0.5 - beta), 0.0
    weights[AUXILIARY, NEW_A] = (1.0 - af) / (1.0 - am)
    weights[AUXILIARY, P], weights[AUXILIARY, A] = -am / (1.0 - am), af / (1.0 - am)
    return Scheme(family, parameter, h, gain, rate, weights)


@inner
def start_step(scheme, history, hat, offset):
    """Fill x_hat and D, both shape (n,), from `history`, shape (DEPTH, n)."""
    weigh(scheme.weights[HAT], history, hat)
    weigh(scheme.weights[OFFSET], history, offset)


@inner
def weigh(weights, history, total):
    """Write the weighted sum of the rows of a history. Only a loop that writes a single array is vectorised."""
    x, v, p, a = history[X], history[V], history[P], history[A]
    for_x, for_v, for_p, for_a = weights[X], weights[V], weights[P], weights[A]
    for i in range(total.shape[0]):
        total[i] = for_x * x[i] + for_v * v[i] + for_p * p[i] + for_a * a[i]


@inner
def finish_step(scheme, position, hat, offset, v, a, history):
    """Write velocities, accelerations and the new history of all scalars from their `position` at the end of the step.

    `hat` and `offset` are those of `start_step`. `v` and `a` are written. All have shape (n,).
    """
    for i in range(position.shape[0]):
        a[i] = scheme.gain * (position[i] - hat[i])
        v[i] = scheme.rate * position[i] + offset[i]
    weights, p, old = scheme.weights[AUXILIARY], history[P], history[A]
    for_a, keep, share = weights[NEW_A], weights[P], weights[A]
    for i in range(position.shape[0]):
        p[i] = for_a * a[i] + keep * p[i] + share * old[i]
    copy(position, history[X])
    copy(v, history[V])
    copy(a, history[A])


@inner
def copy(values, row):
    """Write `values` into `row`."""
    for i in range(row.shape[0]):
        row[i] = values[i]
