"""Every element's forces are the derivative of its energy, and its tangent the derivative of its forces.

With a = A (x - x_hat) the inertia forces of one step derive from 1/2 m A (x - x_hat)^2, so at a frozen instant every
element has a potential, written here from its definition.
"""

from __future__ import annotations

import numpy as np
import pytest
from reference.segments.jets import coordinates, cos, sin

from boom_twin.kernels import plane_algebra as algebra
from boom_twin.kernels.elements import beam, beam_equations, cylinder
from boom_twin.kernels.elements import beam_shapes as modes
from boom_twin.kernels.elements import rigid_body as rigid
from boom_twin.kernels.plane_algebra import turned
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


# -- beam -------------------------------------------------------------------------------------------------------------

COUNT, POINTS = 3, 5


def beam_row(beta, finite=POINTS):
    rows = np.zeros(1, beam.BEAM).view(np.recarray)
    size = COUNT + 1
    rows[0] = (0, COUNT, 1, POINTS, finite, POINTS, size if beta else 0, size, beta, 6.0e4)
    return rows[0]


SIZES = beam.Sizes(COUNT, 1, POINTS)


BASIS = modes.end_shapes_and_bubbles(COUNT, POINTS)
LENGTH = 2.4
TABLES = (
    BASIS.psi,
    modes.integration_matrix(POINTS) * LENGTH,
    modes.bending_stiffness(BASIS, 2.0e4, LENGTH) + 300.0 * np.ones((COUNT, COUNT)),
    np.array([9.0, 20.0, 25.0, 21.0, 8.0]),
    np.array([0.2, 0.3, 0.4, 0.35, 0.1]),
)
BEAM_HATS, BEAM_OFFSETS = rng.normal(size=COUNT + 1 + 3 * POINTS), rng.normal(size=COUNT + 1 + 3 * POINTS)
END_FORCE, END_STIFFNESS = np.array([800.0, -500.0, 300.0, 20.0, 10.0]), rng.normal(size=(5, 5)) * 1e3
END_STIFFNESS = END_STIFFNESS + END_STIFFNESS.T
BEAM_Z = np.array([0.2, -0.1, 0.6, 0.10, -0.15, 0.05, 0.02])  # x, y, theta of the input end, q, eps


def placed(z, row):
    """End position (3,), all histories and the part for input end z[:3] and coordinates z[3:]."""
    rho, drho = np.zeros((POINTS + 1, 2)), np.zeros((POINTS + 1, COUNT + 1, 2))
    part = beam.BeamPart(*TABLES, rho, drho, turn=np.zeros((beam.TURN_ROWS, POINTS + 1)))
    position, c, s = np.zeros(COUNT + 1 + 3 * POINTS), np.cos(z[2]), np.sin(z[2])
    angle = beam.place_beam(row, part, SIZES, z[3:], *z[:3], c, s, position)
    end = z[:2] + np.array([[c, -s], [s, c]]) @ rho[-1]
    return np.append(end, z[2] + angle), position, part


def swept(z, row):
    """Cut at the input end and gains, with two carried slots and the outboard side linearised where the end is."""
    _, position, part = placed(z, row)
    s, p, size = END_STIFFNESS.copy(), END_FORCE.copy(), COUNT + 1
    own = beam_equations.BeamEquations(
        np.zeros((size, 5)), np.zeros((size, size)), np.zeros(size), np.zeros((beam_equations.LOCAL_ROWS, POINTS))
    )
    motion, turn = Motion(GAIN, RATE, BEAM_HATS, BEAM_OFFSETS), (np.cos(z[2]), np.sin(z[2]))
    beam_equations.transfer_beam(row, part, SIZES, own, z[3:], *turn, motion, GRAVITY, position, s, p, np.int64(5))
    return s, p, own.force, own.coupling


def beam_potential(row):
    """Jet over (input end, two carried slots, q): positions by the integral in the head of `kernels.elements.beam`."""
    z = coordinates(np.concatenate([BEAM_Z[:3], np.zeros(2), BEAM_Z[3:]]))
    x, y, theta, carried, q, eps = z[0], z[1], z[2], z[3:5], z[5:-1], z[-1]
    bends = [sum((shape * a for shape, a in zip(psi, q, strict=True)), 0.0) for psi in BASIS.psi]
    angles, co, si = [theta + bend for bend in bends], cos(theta), sin(theta)
    c, s = [cos(a) for a in angles[:-1]], [sin(a) for a in angles[:-1]]
    if row.finite == 0:  # the turn's cosine and sine are 1 and the angle itself
        c, s = [co - si * bend for bend in bends[:-1]], [si + co * bend for bend in bends[:-1]]
    places = []
    for weights in TABLES[1]:
        along, across = (sum((w * v for w, v in zip(weights, values, strict=True)), 0.0) for values in (c, s))
        places.append((x + along + eps * along, y + across + eps * across))
    total = 0.5 * row.axial_stiffness * (eps * eps)
    for a, row_of_k in zip(q, TABLES[2], strict=True):
        for b, k in zip(q, row_of_k, strict=True):
            total = total + 0.5 * k * (a * b)
    hats = BEAM_HATS[COUNT + 1 :]
    for i in range(POINTS):
        for at, hat, mass in zip((*places[i], angles[i]), (*hats[2 * i : 2 * i + 2], hats[2 * POINTS + i]),
                                 (TABLES[3][i], TABLES[3][i], TABLES[4][i]), strict=True):  # fmt: skip
            total = total + 0.5 * GAIN * mass * ((at - float(hat)) * (at - float(hat)))
        total = total - TABLES[3][i] * (GRAVITY[0] * places[i][0] + GRAVITY[1] * places[i][1])
    cut = [*places[-1], angles[-1], *carried]
    away = [at - float(now) for at, now in zip(cut, np.append(placed(BEAM_Z, row)[0], np.zeros(2)), strict=True)]
    for i, a in enumerate(away):
        total = total + END_FORCE[i] * a
        for j, b in enumerate(away):
            total = total + 0.5 * END_STIFFNESS[i, j] * (a * b)
    return total


def dense(row):
    """Gradient and tangent of the beam with its outboard side, over (input end, carried slots, q)."""
    beta = row.beta
    energy = beam_potential(row)
    g, h = energy.g, energy.h
    rate = RATE * BEAM_Z[3:] + BEAM_OFFSETS[: COUNT + 1]
    g[5:] += beta * np.append(TABLES[2] @ rate[:COUNT], row.axial_stiffness * rate[COUNT])
    h[5:-1, 5:-1] += beta * RATE * TABLES[2]
    h[-1, -1] += beta * RATE * row.axial_stiffness
    return g, h


@pytest.mark.parametrize("beta, finite", [(0.0, POINTS), (2e-3, POINTS), (0.0, 0)])
def test_beam_condenses_the_hessian_of_its_energy(beta, finite):
    row = beam_row(beta, finite)
    g, h = dense(row)
    s, p, gain, gains = swept(BEAM_Z, row)
    inner = np.linalg.solve(h[5:, 5:], np.column_stack([h[5:, :5], g[5:]]))
    assert s == pytest.approx(h[:5, :5] - h[:5, 5:] @ inner[:, :5], rel=1e-9, abs=1e-11 * np.abs(h).max())
    assert p == pytest.approx(g[:5] - h[:5, 5:] @ inner[:, 5], rel=1e-9, abs=1e-11 * np.abs(g).max())
    assert gains == pytest.approx(inner[:, :5], rel=1e-9, abs=1e-11 * np.abs(inner).max())
    assert gain == pytest.approx(inner[:, 5], rel=1e-9, abs=1e-11 * np.abs(inner[:, 5]).max())


@pytest.mark.parametrize("finite", [POINTS, 0])
def test_beam_shape_derivatives(finite):
    row = beam_row(0.0, finite)
    part = placed(BEAM_Z, row)[2]
    beam_equations.shape_derivatives(part, SIZES, 1.0 + BEAM_Z[-1])
    drho = part.drho
    expected = gradient(lambda q: placed(np.append(BEAM_Z[:3], q), row)[2].rho, BEAM_Z[3:])
    assert drho == pytest.approx(np.moveaxis(expected, -1, 1), abs=1e-8)


# -- rigid parts ------------------------------------------------------------------------------------------------------


def test_body_forces_and_tangent():
    hat, arm, mass, inertia = np.array([0.3, -0.2, 0.1]), np.array([0.4, 0.25]), 12.0, 0.8

    def place(e):
        return e + np.append(turned(e[2], *arm), 0.0)

    def potential(e):
        at = place(e)
        weight = mass * GRAVITY @ at[:2]
        return 0.5 * GAIN * np.array([mass, mass, inertia]) @ (at - hat) ** 2 - weight

    def swept_body(e):
        s, p, at = np.zeros((3, 3)), np.zeros(3), place(e)
        force = mass * (GAIN * (at - hat)[:2] - GRAVITY)
        rigid.add_body_force(p, *(at - e)[:2], *force, inertia * GAIN * (at - hat)[2])
        rigid.add_body_tangent(s, mass, inertia, *(at - e)[:2], *force, GAIN)
        return p, s

    e = np.array([0.5, 0.1, 0.7])
    assert swept_body(e)[0] == pytest.approx(gradient(potential, e), rel=1e-6)
    tangent = gradient(lambda e: swept_body(e)[0], e)
    assert swept_body(e)[1] == pytest.approx(tangent, rel=1e-7, abs=1e-3)


@pytest.mark.parametrize("slots", [5, 6])
def test_outlet_and_offset(slots):
    """A second outlet at one arm, then an offset, against congruence with the Jacobian plus second derivatives."""
    stiffness = rng.normal(size=(slots, slots))
    stiffness = stiffness + stiffness.T
    force, outlet, offset, theta = rng.normal(size=slots), (0.6, -0.3), (1.2, 0.1), 0.4

    def potential(w):
        end = w[:2] + turned(theta + w[2], *offset) - np.array(turned(theta, *offset))
        pin = w[:2] + turned(theta + w[2], *outlet) - np.array(turned(theta, *outlet))
        increments = np.concatenate([end, w[2:3], pin, w[3:]])
        return force @ increments + 0.5 * increments @ stiffness @ increments

    s, p = np.zeros((6, 6)), np.zeros(6)
    s[:slots, :slots], p[:slots] = stiffness, force
    rigid.pull_back(s, p, slots, 0, 1, *turned(theta, *offset), True)
    rigid.merge_outlet(s, p, slots, *turned(theta, *outlet), True)
    m = slots - 2
    zero = np.zeros(slots - 2)
    assert m == slots - 2
    assert p[:m] == pytest.approx(gradient(potential, zero), abs=1e-8)
    assert s[:m, :m] == pytest.approx(gradient(lambda w: gradient(potential, w, 1e-4), zero, 1e-4), abs=1e-6)


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
