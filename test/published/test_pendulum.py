"""Point mass on a rigid rod, L = m = 1, let go from the horizontal: MBS Benchmark library of IFToMM, problem A01.

M. Gonzalez, D. Dopico, U. Lugris, J. Cuadrado: A benchmarking system for MBS simulation software, Multibody System Dynamics 16,
2006. The positions are those of the closed form with Jacobi's functions.
"""

from __future__ import annotations

import numpy as np
import pytest
from published import motion, scenes
from scipy.special import ellipj, ellipk

GRAVITY, DURATION, STEP = 9.81, 10.0, 4e-3
AT_TEN = (-0.2750874626, -0.9614192051)  # m
PERIOD = 2.3678419476  # s


def closed_form(times):
    """Place of the mass (m), shape (m, 2): sin(phi/2) = k sn(K - w t, k), phi from the vertical, k = sin(pi/4)."""
    sine = np.sqrt(0.5) * ellipj(ellipk(0.5) - np.sqrt(GRAVITY) * times, 0.5)[0]
    phi = -2.0 * np.arcsin(sine)
    return np.stack([np.sin(phi), -np.cos(phi)], axis=-1)


@pytest.fixture(scope="module")
def results():
    """Tip at every second, for steps of 4, 2, 1 and 0.5 ms, from (-1, 0)."""
    scene = scenes.scene([scenes.rigid(1.0, 1.0, 1.0, 0.0)], [scenes.crank(scenes.FREE)])
    return motion.halved(motion.released(scene, [np.pi]), STEP, DURATION, 10)


def test_closed_form_has_the_printed_digits():
    assert closed_form(np.array([DURATION]))[0] == pytest.approx(AT_TEN, abs=1e-10)
    assert 4.0 * ellipk(0.5) / np.sqrt(GRAVITY) == pytest.approx(PERIOD, abs=1e-10)


def test_acceleration_at_the_start(results):
    assert results[0, 0, 2, :2] == pytest.approx([0.0, -GRAVITY], abs=1e-6)


def test_second_order(results):
    errors = np.linalg.norm(results[:, 1:, 0, :2] - closed_form(np.arange(1.0, 11.0)), axis=-1).max(axis=1)
    assert motion.orders(errors) == pytest.approx(2.0, abs=0.01)


def test_position_after_ten_seconds(results):
    """1.3e-4 m at 1 ms; what is left of the step's square by extrapolation is 1e-8 m."""
    at_end = results[:, -1, 0, :2]
    assert np.linalg.norm(at_end[2] - AT_TEN) == pytest.approx(1.27e-4, rel=0.02)
    assert np.linalg.norm(motion.extrapolated(at_end) - AT_TEN) < 3e-8
