"""Two uniform rods, L = m = 1, hinged to each other, let go at rest from the horizontal.

Equations: e.g. D. A. Wells, Theory and Problems of Lagrangian Dynamics, 1967; integrated here by themselves to ten digits. The
second pivot is a six-bar of massless links on a cylinder of next to no stiffness.
"""

from __future__ import annotations

import numpy as np
import pytest
from published import motion, scenes
from scipy.integrate import solve_ivp

GRAVITY, STEP = 9.81, 4e-3
TIMES = (0.5, 1.0)
ANGLES = np.array([[0.4481426259, 1.0419628873], [-1.2077162382, -0.8143910231]])  # rad from straight down


def lagrange(_, state):
    """Rates of the angles from straight down and of their rates."""
    a, b, u, v = state
    c, s = np.cos(a - b), np.sin(a - b)
    mass = np.array([[4.0 / 3.0, 0.5 * c], [0.5 * c, 1.0 / 3.0]])
    force = [-0.5 * s * v**2 - 1.5 * GRAVITY * np.sin(a), 0.5 * s * u**2 - 0.5 * GRAVITY * np.sin(b)]
    return [u, v, *np.linalg.solve(mass, force)]


def tips(angles):
    """End of the second rod, m, shape (m, 2)."""
    return np.stack([np.sin(angles).sum(axis=1), -np.cos(angles).sum(axis=1)], axis=-1)


@pytest.fixture(scope="module")
def results():
    """Tip at 0, 0.5 and 1 s, for steps of 4, 2, 1 and 0.5 ms."""
    joints = [scenes.crank(scenes.FREE), scenes.six_bar(scenes.FREE)]
    scene = scenes.scene([scenes.rigid(1.0, 1.0, 0.5, 1.0 / 12.0)] * 2, joints)
    return motion.halved(motion.released(scene, [0.0, 0.0]), STEP, 1.0, 2)


def test_lagranges_equations_give_the_printed_digits():
    start = [np.pi / 2, np.pi / 2, 0.0, 0.0]
    found = solve_ivp(lagrange, (0.0, 1.0), start, "DOP853", TIMES, rtol=1e-13, atol=1e-13)
    assert np.abs(found.y[:2].T - ANGLES).max() < 2e-10


def test_acceleration_at_the_start(results):
    """The angles start with -9/7 g/L and 3/7 g/L: the outer rod is turned the other way."""
    inner, outer = np.array([-9.0, 3.0]) / 7.0 * GRAVITY
    assert results[0, 0, 2] == pytest.approx([0.0, inner + outer, outer], abs=1e-6)


def test_second_order(results):
    errors = np.linalg.norm(results[:, 1:, 0, :2] - tips(ANGLES), axis=-1)
    assert motion.orders(errors) == pytest.approx(2.0, abs=0.005)


def test_angles_and_tip(results):
    """8e-6 m at 1 ms; 4e-10 m by extrapolation."""
    assert np.linalg.norm(results[2, 1:, 0, :2] - tips(ANGLES), axis=-1).max() < 1e-5
    limit = motion.extrapolated(results[:, 1:, 0])
    assert limit[:, :2] == pytest.approx(tips(ANGLES), abs=1e-9)
    assert limit[:, 2] + np.pi / 2 == pytest.approx(ANGLES[:, 1], abs=1e-9)
