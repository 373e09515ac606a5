"""Generalised-alpha: its coefficients against the published ones, its order, and its damping of high frequencies."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.physics.integrators import finish_step, generalised_alpha, start_step

RHOS = [0.0, 0.3, 0.8, 1.0]


@pytest.mark.parametrize("rho", RHOS)
def test_coefficients(rho):
    """Chung and Hulbert 1993, equations 25 (am, af) and 17, 20 (gamma, beta)."""
    s = generalised_alpha(0.01, rho)
    assert s.am == pytest.approx((2 * rho - 1) / (rho + 1))
    assert s.af == pytest.approx(rho / (rho + 1))
    assert s.gamma == pytest.approx(0.5 - s.am + s.af)
    assert s.beta == pytest.approx(0.25 * (1 - s.am + s.af) ** 2)
    assert s.gain == pytest.approx((1 - s.am) / ((1 - s.af) * s.beta * 1e-4))
    assert s.rate == pytest.approx(s.gamma / (s.beta * 0.01))


@pytest.mark.parametrize("rho", RHOS)
def test_a_step_satisfies_the_defining_equations(rho):
    h, rng = 0.02, np.random.default_rng(1)
    s, history = generalised_alpha(h, rho), rng.normal(size=(5, 4))
    x, v, a, p = history.T.copy()
    hat, offset, new = np.zeros(5), np.zeros(5), rng.normal(size=5)
    start_step(s, history, hat, offset)
    finish_step(s, new, hat, offset, history)
    x1, v1, a1, p1 = history.T
    assert x1 == pytest.approx(new)
    assert x1 == pytest.approx(x + h * v + h * h * ((0.5 - s.beta) * p + s.beta * p1))
    assert v1 == pytest.approx(v + h * ((1 - s.gamma) * p + s.gamma * p1))
    assert (1 - s.am) * p1 + s.am * p == pytest.approx((1 - s.af) * a1 + s.af * a, abs=1e-9 * np.abs(a1).max())


def oscillator(step, rho, omega=6.0, zeta=0.05, duration=1.0):
    """x'' + 2 zeta omega x' + omega^2 x = 0 from x = 1 at rest: final x, v, a."""
    s = generalised_alpha(step, rho)
    history = np.array([[1.0, 0.0, -(omega**2), -(omega**2)]])
    hat, offset = np.zeros(1), np.zeros(1)
    for _ in range(round(duration / step)):
        start_step(s, history, hat, offset)
        right = s.gain * hat - 2 * zeta * omega * offset
        finish_step(s, right / (s.gain + 2 * zeta * omega * s.rate + omega**2), hat, offset, history)
    return history[0, :3]


@pytest.mark.parametrize("rho", RHOS)
def test_second_order_on_a_damped_oscillator(rho):
    omega, zeta = 6.0, 0.05
    root = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    factor = np.conj(root) / (np.conj(root) - root)
    exact = [2 * np.real(factor * root**k * np.exp(root)) for k in range(3)]
    steps = np.array([2e-3, 1e-3, 5e-4])
    errors = np.array([np.abs(oscillator(h, rho) - exact) for h in steps])
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.12)


@pytest.mark.parametrize("rho", [0.3, 0.8])
def test_spectral_radius_at_high_frequency(rho):
    s = generalised_alpha(1.0, rho)
    hat, offset, omega, norms = np.zeros(1), np.zeros(1), 1e6, []
    history = np.array([[1.0, 0.0, -(omega**2), -(omega**2)]])
    for _ in range(60):
        start_step(s, history, hat, offset)
        finish_step(s, s.gain * hat / (s.gain + omega**2), hat, offset, history)
        norms.append(abs(history[0, 3]))
    assert (norms[-1] / norms[-21]) ** (1 / 20) == pytest.approx(rho, rel=0.2)
    assert norms[-1] < norms[-21]
