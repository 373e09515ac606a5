"""A cylinder's forces are the derivative of its energy, and its tangent the derivative of its forces; elimination by NumPy.

With a = A (x - x_hat) the inertia forces of one step derive from 1/2 m A (x - x_hat)^2, so at a frozen instant a cylinder has a
potential, written here from its definition. Beams and rigid parts are in `test_sweep`, where a wrong term of theirs leaves the
equations unsolved.
"""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.kernels import plane_algebra as algebra
from boom_twin.kernels.elements import cylinder
from boom_twin.kernels.tables import Motion

GRAVITY = np.array([0.7, -9.5])
GAIN, RATE = 3.0e3, 90.0
rng = np.random.default_rng(7)


def gradient(function, z, size=1e-6):
    """Central differences of a scalar or vector function."""
    columns = []
    for i in range(len(z)):
        up, down = z.copy(), z.copy()
        up[i] += size
        down[i] -= size
        columns.append((np.asarray(function(up)) - np.asarray(function(down))) / (2 * size))
    return np.stack(columns, axis=-1)


# -- cylinder ---------------------------------------------------------------------------------------------------------

HATS = rng.normal(size=7)
PARTS = np.zeros(2, cylinder.CYLINDER_PART).view(np.recarray)
PARTS[0] = (cylinder.BARREL, 1, 0.3, 22.0, 1.1)
PARTS[1] = (cylinder.ROD, 4, 0.4, 14.0, 0.6)
OILS = np.zeros(0, cylinder.OIL).view(np.recarray)


def cylinder_row(compliance, lag):
    rows = np.zeros(1, cylinder.CYLINDER).view(np.recarray)
    rows[0] = (0, 0, 0, 2, 0, 0, 1.0, compliance, lag, -1)
    return rows[0]


def cylinder_forces(z, row, drive=1.2, drive_rate=0.3):
    g, h, position = np.zeros(5), np.zeros((5, 5)), np.zeros(7)
    cylinder.place_cylinder(row, PARTS, *z[:4], np.zeros(7), position)
    motion = Motion(GAIN, RATE, HATS, 0.1 * HATS)
    cylinder.cylinder_terms(row, PARTS, OILS, *z, drive, drive_rate, motion, GRAVITY, position, g, h)
    return g, h


def cylinder_potential(z, row, drive=1.2):
    """Masses, and N (l - l_ref) - N^2/(2k): its derivative by N is the undamped law."""
    c, r, force = z[:2], z[2:4], z[4]
    axis, length = (r - c) / np.hypot(*(r - c)), np.hypot(*(r - c))
    turn, total = np.arctan2(*axis[::-1]), 0.0
    for part, start, sign in ((PARTS[0], c, 1.0), (PARTS[1], r, -1.0)):
        at, hat = start + sign * part.com * axis, HATS[part.history : part.history + 3]
        total += 0.5 * part.mass * GAIN * np.sum((at - hat[:2]) ** 2) - part.mass * GRAVITY @ at
        total += 0.5 * part.inertia * GAIN * (turn - hat[2]) ** 2
    return total + force * (length - drive) - 0.5 * row.compliance * force**2


CYLINDER_Z = np.array([0.2, -0.4, 1.1, 0.5, -3.0e3])


@pytest.mark.parametrize("compliance", [0.0, 2.5e-8])
def test_cylinder_forces_derive_from_energy(compliance):
    row = cylinder_row(compliance, 0.0)
    g, _ = cylinder_forces(CYLINDER_Z, row)
    expected = gradient(lambda z: cylinder_potential(z, row), CYLINDER_Z)
    assert g == pytest.approx(expected, rel=1e-7, abs=1e-3)


@pytest.mark.parametrize("lag", [0.0, 3e-3])
def test_cylinder_tangent(lag):
    row = cylinder_row(2.5e-8, lag)
    _, h = cylinder_forces(CYLINDER_Z, row)
    expected = gradient(lambda z: cylinder_forces(z, row)[0], CYLINDER_Z)
    assert h == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(h).max())
    assert h == pytest.approx(h.T, rel=1e-12)


def test_cylinder_law_with_damping():
    """N = k (l - l_ref) + d (l' - l_ref') must make the law's residual vanish, whatever scales it."""
    stiffness, damping, drive, drive_rate = 4.0e7, 1.2e5, 1.2, 0.3
    row = cylinder_row(1.0 / stiffness, damping / stiffness)
    z = CYLINDER_Z.copy()
    length = np.hypot(*(z[2:4] - z[:2]))
    speed = RATE * length + 0.1 * HATS[0]
    z[4] = stiffness * (length - drive) + damping * (speed - drive_rate)
    assert abs(cylinder_forces(z, row)[0][4]) < 1e-12


# -- algebra ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("m, n", [(3, 4), (5, 1), (1, 6)])
def test_condense_against_numpy(m, n):
    h = rng.normal(size=(m + n, m + n))
    h, g = h + h.T, rng.normal(size=m + n)
    inner = np.linalg.solve(h[m:, m:], np.column_stack([h[m:, :m], g[m:]]))
    s, p, coupling, block, force = h[:m, :m].copy(), g[:m].copy(), h[m:, :m].copy(), h[m:, m:].copy(), g[m:].copy()
    negative = int(np.sum(np.linalg.eigvalsh(block) < 0.0))
    assert algebra.condense(s, p, coupling, block, force, m, n) == negative
    assert s == pytest.approx(h[:m, :m] - h[:m, m:] @ inner[:, :m], rel=1e-9)
    assert p == pytest.approx(g[:m] - h[:m, m:] @ inner[:, m], rel=1e-9)
    assert coupling == pytest.approx(inner[:, :m], rel=1e-9)
    assert force == pytest.approx(inner[:, m], rel=1e-9)


def test_condense_reports_a_vanishing_pivot():
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    assert algebra.condense(one, np.ones(1), np.ones((1, 1)), none, np.ones(1), 1, 1) == -1


def test_solve_pivots_and_reports_singular():
    a, b = rng.normal(size=(6, 6)), rng.normal(size=(6, 3))
    a[0, 0] = 0.0
    expected, x = np.linalg.solve(a, b), b.copy()
    assert algebra.solve(a.copy(), x, 6, 3, np.zeros(6, np.int64))
    assert x == pytest.approx(expected, rel=1e-9)
    a[3] = 0.0
    assert not algebra.solve(a, b.copy(), 6, 3, np.zeros(6, np.int64))
