"""Time integrators as tables of weights: acceleration and velocity of a scalar as affine functions of its new position.

    a' = A (x' - x_hat),   v' = C x' + D,   x_hat and D linear in the scalar's history.

A prime marks the instant that is solved for. Every scheme is such a table of weights, so all schemes share the loops over
scalars. A history is a column of

    [ x, v two steps ago; x, v one step ago; ]  x, v, p, a  now            (the last four are X, V, P, A)

A step computes every row from the new x', v', a' and the old rows from its own index on, in that order.

Generalised-alpha (Chung and Hulbert 1993; with the auxiliary acceleration p of [AB] in `boom_twin.kernels`)

    x' = x + h v + h^2 ((1/2 - beta) p + beta p'),   v' = v + h ((1 - gamma) p + gamma p'),
    (1 - am) p' + am p = (1 - af) a' + af a;

rho is the spectral radius at infinite frequency: 1 keeps every frequency, 0 kills the highest within one step. Positions of
constrained points are integrated directly (index 3), which needs rho < 1. Newmark is am = af = 0, beta = (gamma + 1/2)^2/4.
Wilson-theta has linear acceleration up to t + theta h, solves there, and returns to t + h. Houbolt: cubic through four
positions. Park 1975: mean of the two- and three-step backward differences, for x and again for v. `REST` has A = C = 0
(statics) and writes a history without motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..types import Array
from .jit import inner

GENERALISED_ALPHA, NEWMARK, WILSON, HOUBOLT, PARK, REST = range(6)
X, V, P, A = -4, -3, -2, -1  # rows of a history, from its end
NEW_X, NEW_V, NEW_A, OLD = 0, 1, 2, 3  # columns of weights: new x', v', a', then the old history
HAT, OFFSET, ROWS = 0, 1, 2  # rows of weights: x_hat, D, then the new history
DEPTH, LONG_DEPTH = 4, 8


class Scheme(NamedTuple):
    """One scheme at one step size; `family` and `parameter` are arguments of `prepare`."""

    family: np.int64
    parameter: float
    reach: float  # time from the newest history to the instant that is solved for, s
    gain: float  # A, 1/s^2
    rate: float  # C, 1/s
    weights: Array  # (2 + depth, 3 + depth), see the module's constants


def depth_of(family: int) -> int:
    """Return the number of history rows of the family."""
    return LONG_DEPTH if family in (HOUBOLT, PARK) else DEPTH


def new_weights(depth: int) -> Array:
    """Return an array for a scheme's weights."""
    return np.zeros((ROWS + depth, OLD + depth))


@inner
def prepare(family, parameter, step, weights):
    """Return the scheme of `family` for `step` (s). `parameter` is rho, Newmark's gamma or theta. Fills `weights`."""
    family = np.int64(family)
    for k in range(weights.shape[0]):
        for j in range(weights.shape[1]):
            weights[k, j] = 0.0
    if family == REST:
        for k in range(ROWS, weights.shape[0] - 3, 2):
            weights[k, NEW_X] = 1.0
        return Scheme(family, parameter, 0.0, 0.0, 0.0, weights)
    weights[X, NEW_X], weights[V, NEW_V], weights[A, NEW_A] = 1.0, 1.0, 1.0
    if family == GENERALISED_ALPHA:
        am, af = (2.0 * parameter - 1.0) / (parameter + 1.0), parameter / (parameter + 1.0)
        return one_step(family, parameter, am, af, 0.5 + af - am, step, weights)
    if family == NEWMARK:
        return one_step(family, parameter, 0.0, 0.0, parameter, step, weights)
    if family == WILSON:
        return wilson(family, parameter, step, weights)
    for k in range(4):  # x, v two steps and one step ago
        weights[ROWS + k, OLD + k + 2] = 1.0
    if family == HOUBOLT:
        return houbolt(family, parameter, step, weights)
    return park(family, parameter, step, weights)


@inner
def one_step(family, parameter, am, af, gamma, h, weights):
    """Return generalised-alpha; beta follows from gamma."""
    beta = 0.25 * (gamma + 0.5) ** 2
    gain, rate = (1.0 - am) / ((1.0 - af) * beta * h * h), gamma / (beta * h)
    share = 1.0 / ((1.0 - af) * gain)
    weights[HAT, X], weights[HAT, V] = 1.0, h
    weights[HAT, P], weights[HAT, A] = h * h * (0.5 - beta) - am * share, af * share
    weights[OFFSET, X], weights[OFFSET, V] = -rate, 1.0 - rate * h
    weights[OFFSET, P] = h * (1.0 - gamma) - rate * h * h * (0.5 - beta)
    weights[P, NEW_A], weights[P, A], weights[P, P] = (1.0 - af) / (1.0 - am), af / (1.0 - am), -am / (1.0 - am)
    return Scheme(family, parameter, h, gain, rate, weights)


@inner
def wilson(family, theta, h, weights):
    """Wilson-theta, theta >= 1.37 for unconditional stability on an oscillator.

    The acceleration is linear from a to a' over r = theta h. Two integrations give

        v' = v + r/2 (a + a'),    x' = x + r v + r^2/6 (2 a + a').

    The second gives a' = 6/r^2 (x' - x_hat) with x_hat = x + r v + r^2/3 a. With this a', the first is
    v' = 3/r x' + D with D = -3/r x - 2 v - r/2 a. The step itself ends at h = r/theta with the acceleration
    a + (a' - a)/theta. The same integrals over h give the weights of the new X, V, A.
    """
    reach, part = theta * h, 1.0 / theta
    weights[HAT, X], weights[HAT, V], weights[HAT, A] = 1.0, reach, reach * reach / 3.0
    weights[OFFSET, X], weights[OFFSET, V], weights[OFFSET, A] = -3.0 / reach, -2.0, -0.5 * reach
    weights[X, NEW_X], weights[X, X], weights[X, V] = 0.0, 1.0, h
    weights[X, NEW_A], weights[X, A] = h * h / 6.0 * part, h * h / 6.0 * (3.0 - part)
    weights[V, NEW_V], weights[V, V] = 0.0, 1.0
    weights[V, NEW_A], weights[V, A] = 0.5 * h * part, 0.5 * h * (2.0 - part)
    weights[A, NEW_A], weights[A, A] = part, 1.0 - part
    return Scheme(family, theta, reach, 6.0 / (reach * reach), 3.0 / reach, weights)


@inner
def houbolt(family, parameter, h, weights):
    """Houbolt's backward differences."""
    weights[HAT, X], weights[HAT, OLD + 2], weights[HAT, OLD] = 2.5, -2.0, 0.5
    weights[OFFSET, X], weights[OFFSET, OLD + 2], weights[OFFSET, OLD] = -3.0 / h, 1.5 / h, -1.0 / (3.0 * h)
    return Scheme(family, parameter, h, 2.0 / (h * h), 11.0 / (6.0 * h), weights)


@inner
def park(family, parameter, h, weights):
    """Park's stiffly stable backward differences.

    With x1, x2 one and two steps before x, the differences over two and over three steps are

        h v' = 3/2 x' - 2 x + 1/2 x1,    h v' = 11/6 x' - 3 x + 3/2 x1 - 1/3 x2.    Their mean is

        v' = C x' + D,    C = 10/(6 h),    D = (-5/2 x + x1 - 1/6 x2)/h.

    The same formula for v gives a' = C v' + D_v, with D_v of v, v1, v2 as D of x, x1, x2. With v' from above,
    a' = C^2 (x' - x_hat), x_hat = -D/C - D_v/C^2 = 3/2 x - 3/5 x1 + 1/10 x2 + h (0.9 v - 0.36 v1 + 0.06 v2).
    """
    weights[HAT, X], weights[HAT, OLD + 2], weights[HAT, OLD] = 1.5, -0.6, 0.1
    weights[HAT, V], weights[HAT, OLD + 3], weights[HAT, OLD + 1] = 0.9 * h, -0.36 * h, 0.06 * h
    weights[OFFSET, X], weights[OFFSET, OLD + 2], weights[OFFSET, OLD] = -2.5 / h, 1.0 / h, -1.0 / (6.0 * h)
    rate = 10.0 / (6.0 * h)
    return Scheme(family, parameter, h, rate * rate, rate, weights)


@inner
def start_step(scheme, history, hat, offset):
    """Fill x_hat and D, both shape (n,), from `history`, shape (depth, n)."""
    weigh_newest(scheme.weights[HAT], history, hat)
    weigh_newest(scheme.weights[OFFSET], history, offset)
    for k in range(history.shape[0] - DEPTH):
        row, for_hat, for_offset = history[k], scheme.weights[HAT, OLD + k], scheme.weights[OFFSET, OLD + k]
        for i in range(hat.shape[0]):
            hat[i] += for_hat * row[i]
            offset[i] += for_offset * row[i]


@inner
def weigh_newest(weights, history, total):
    """Write the weighted sum of the newest four rows. Only a loop that writes a single array is vectorised."""
    x, v, p, a = history[X], history[V], history[P], history[A]
    for_x, for_v, for_p, for_a = weights[X], weights[V], weights[P], weights[A]
    for i in range(total.shape[0]):
        total[i] = for_x * x[i] + for_v * v[i] + for_p * p[i] + for_a * a[i]


@inner
def finish_step(scheme, position, hat, offset, v, a, history):
    """Write velocities, accelerations and the new history of all scalars from their `position` at the instant solved for.

    `hat` and `offset` are those of `start_step`. `v` and `a` are written. All have shape (n,).
    """
    for i in range(position.shape[0]):
        a[i] = scheme.gain * (position[i] - hat[i])
        v[i] = scheme.rate * position[i] + offset[i]
    if scheme.family == WILSON:  # the step ends before the instant solved for
        renew_rows(scheme.weights, position, v, a, history, history.shape[0])
        return
    renew_rows(scheme.weights, position, v, a, history, history.shape[0] - DEPTH)
    weights, p, old = scheme.weights[P], history[P], history[A]
    for_a, keep, share = weights[NEW_A], weights[P], weights[A]
    for i in range(position.shape[0]):
        p[i] = for_a * a[i] + keep * p[i] + share * old[i]
    weigh(scheme.weights[X, NEW_X], position, history[X])
    weigh(scheme.weights[V, NEW_V], v, history[V])
    weigh(scheme.weights[A, NEW_A], a, history[A])


@inner
def weigh(weight, of, row):
    """Write `weight` times `of` into `row`."""
    for i in range(of.shape[0]):
        row[i] = weight * of[i]


@inner
def renew_rows(weights, position, v, a, history, rows):
    """Update the first `rows` rows of `history`, each from old rows at or after its own index."""
    for k in range(rows):
        row, own = history[k], weights[ROWS + k]
        for_x, for_v, for_a, keep = own[NEW_X], own[NEW_V], own[NEW_A], own[OLD + k]
        for i in range(position.shape[0]):
            row[i] = for_x * position[i] + for_v * v[i] + for_a * a[i] + keep * row[i]
        for j in range(k + 1, history.shape[0]):
            share, older = own[OLD + j], history[j]
            if share != 0.0:
                for i in range(position.shape[0]):
                    row[i] += share * older[i]
