"""Generalised-alpha: acceleration and velocity of a scalar as affine functions of its new position.

With the auxiliary acceleration p (source: [AB] in `boom_twin.notation`; coefficients of Chung and Hulbert 1993)

    x' = x + h v + h^2 ((1/2 - beta) p + beta p'),   v' = v + h ((1 - gamma) p + gamma p'),
    (1 - am) p' + am p = (1 - af) a' + af a,

a prime marking the new time. Solved for the new acceleration and velocity:

    a' = A (x' - x_hat),   x_hat = x* - (am p - af a) / ((1 - af) A),   x* = x + h v + h^2 (1/2 - beta) p,
    v' = C x' + D,         D = v + h (1 - gamma) p - C x*.

rho is the spectral radius at infinite frequency: 1 keeps every frequency, 0 kills the highest within one step. Positions
of constrained points are integrated directly (index 3), which needs rho < 1.
"""

from __future__ import annotations

from typing import NamedTuple

from .jit import inner


class Scheme(NamedTuple):
    """Coefficients for one step size; see the module's equations. `gain` is A (1/s^2), `rate` is C (1/s)."""

    step: float
    am: float
    af: float
    beta: float
    gamma: float
    gain: float
    rate: float


@inner
def generalised_alpha(step, rho):
    """Coefficients for `step` (s) and spectral radius `rho` in [0, 1]."""
    am, af = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    return Scheme(step, am, af, beta, gamma, (1.0 - am) / ((1.0 - af) * beta * step * step), gamma / (beta * step))


@inner
def start_step(scheme, history, hat, offset):
    """Fill x_hat and D, both shape (n,), from `history`, shape (n, 4): columns x, v, a, p."""
    h = scheme.step
    share = 1.0 / ((1.0 - scheme.af) * scheme.gain)
    for i in range(history.shape[0]):
        x, v, a, p = history[i, 0], history[i, 1], history[i, 2], history[i, 3]
        ahead = x + h * v + h * h * (0.5 - scheme.beta) * p
        hat[i] = ahead - (scheme.am * p - scheme.af * a) * share
        offset[i] = v + h * (1.0 - scheme.gamma) * p - scheme.rate * ahead


@inner
def finish_step(scheme, position, hat, offset, history):
    """Write the new x, v, a, p of all scalars at their new `position`, shape (n,)."""
    for i in range(history.shape[0]):
        a_old, p_old = history[i, 2], history[i, 3]
        a = scheme.gain * (position[i] - hat[i])
        history[i, 0] = position[i]
        history[i, 1] = scheme.rate * position[i] + offset[i]
        history[i, 2] = a
        history[i, 3] = ((1.0 - scheme.af) * a + scheme.af * a_old - scheme.am * p_old) / (1.0 - scheme.am)
