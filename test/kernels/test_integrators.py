"""Time integrators: published coefficients, defining equations, order, damping of high frequencies."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.kernels.integrators import (
    GENERALISED_ALPHA,
    HOUBOLT,
    NEWMARK,
    PARK,
    WILSON,
    A,
    P,
    V,
    X,
    depth_of,
    finish_step,
    new_weights,
    prepare,
    start_step,
)

RHOS = [0.0, 0.3, 0.8, 1.0]
SCHEMES = [(GENERALISED_ALPHA, rho) for rho in RHOS] + [(NEWMARK, 0.5), (WILSON, 1.4), (HOUBOLT, 0.0), (PARK, 0.0)]


def scheme_of(family, parameter, step):
    return prepare(family, parameter, step, new_weights(depth_of(family)))


def published(rho):
    """am, af, gamma, beta of Chung and Hulbert 1993, equations 25, 17, 20."""
    am, af = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    return am, af, 0.5 - am + af, 0.25 * (1 - am + af) ** 2


@pytest.mark.parametrize("rho", RHOS)
def test_a_step_satisfies_the_defining_equations(rho):
    h, rng = 0.02, np.random.default_rng(1)
    am, af, gamma, beta = published(rho)
    s, history = scheme_of(GENERALISED_ALPHA, rho, h), rng.normal(size=(4, 5))
    x, v, p, a = history.copy()
    new = stepped(s, history, rng.normal(size=5))
    x1, v1, p1, a1 = history
    assert x1 == pytest.approx(new)
    assert x1 == pytest.approx(x + h * v + h * h * ((0.5 - beta) * p + beta * p1))
    assert v1 == pytest.approx(v + h * ((1 - gamma) * p + gamma * p1))
    assert (1 - am) * p1 + am * p == pytest.approx((1 - af) * a1 + af * a, abs=1e-9 * np.abs(a1).max())


def stepped(scheme, history, new):
    """Take positions `new`; returns them."""
    hat, offset, v, a = np.zeros((4, len(new)))
    start_step(scheme, history, hat, offset)
    finish_step(scheme, new, hat, offset, v, a, history)
    return new


@pytest.mark.parametrize("family", [NEWMARK, WILSON, HOUBOLT, PARK])
def test_motion_that_a_scheme_reproduces(family):
    """A parabola is followed without error: x, v, a at the new time, from exact values at the old ones."""
    h, parameter = 0.1, {NEWMARK: 0.5, WILSON: 1.4}.get(family, 0.0)
    s, depth = scheme_of(family, parameter, h), depth_of(family)

    def x(t):
        return 0.3 + 0.7 * t - 1.1 * t * t

    def v(t):
        return 0.7 - 2.2 * t

    rows = [x(-2 * h), v(-2 * h), x(-h), v(-h), x(0), v(0), -2.2, -2.2]
    history = np.array(rows[-depth:])[:, None]
    stepped(s, history, np.array([x(s.reach)]))
    assert history[[X, V, A], 0] == pytest.approx([x(h), v(h), -2.2], abs=1e-12)
    if depth == 8:
        assert history[:4, 0] == pytest.approx([x(-h), v(-h), x(0), v(0)], abs=1e-12)


def oscillator(family, parameter, step, omega=6.0, zeta=0.05, duration=1.0):
    """x'' + 2 zeta omega x' + omega^2 x = 0 from x = 1 at rest: final x, v, a. Earlier values are the exact ones."""
    s = scheme_of(family, parameter, step)
    exact = np.array([solution(-2 * step), solution(-step), solution(0.0)])
    history = np.append(exact[:, :2].ravel(), [exact[-1, 2], exact[-1, 2]])[-depth_of(family) :, None]
    hat, offset, v, a = np.zeros((4, 1))
    for _ in range(round(duration / step)):
        start_step(s, history, hat, offset)
        right = s.gain * hat - 2 * zeta * omega * offset
        finish_step(s, right / (s.gain + 2 * zeta * omega * s.rate + omega**2), hat, offset, v, a, history)
    return history[[X, V, A], 0]


def solution(time, omega=6.0, zeta=0.05):
    """Exact x, v, a of the same."""
    root = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    factor = np.conj(root) / (np.conj(root) - root)
    return [2 * np.real(factor * root**k * np.exp(root * time)) for k in range(3)]


@pytest.mark.parametrize("family, parameter", SCHEMES)
def test_second_order_on_a_damped_oscillator(family, parameter):
    steps = np.array([1e-3, 5e-4, 2.5e-4])
    errors = np.array([np.abs(oscillator(family, parameter, h) - solution(1.0)) for h in steps])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.12)


def test_newmark_with_numerical_damping_is_of_first_order():
    errors = [np.abs(oscillator(NEWMARK, 0.6, h) - solution(1.0)) for h in (1e-3, 5e-4)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("rho", [0.3, 0.8])
def test_spectral_radius_at_high_frequency(rho):
    s = scheme_of(GENERALISED_ALPHA, rho, 1.0)
    (hat, offset, v, a), omega, norms = np.zeros((4, 1)), 1e6, []
    history = np.array([[1.0], [0.0], [-(omega**2)], [-(omega**2)]])
    for _ in range(60):
        start_step(s, history, hat, offset)
        finish_step(s, s.gain * hat / (s.gain + omega**2), hat, offset, v, a, history)
        norms.append(abs(history[P, 0]))
    assert (norms[-1] / norms[-21]) ** (1 / 20) == pytest.approx(rho, rel=0.2)
    assert norms[-1] < norms[-21]
