"""Flexible beam part in a floating frame at its input end I: Euler-Bernoulli, exact in rotation, static axial stretch.

Coordinates q: n bending ones and, if the row says so, one axial strain eps. The cross-section at arc s is turned by
psi(s).q against the input end, psi(0) = 0; the curvature is psi'(s).q, so bending energy is quadratic, 1/2 q.K q, for any
rotation. Positions follow by integration along the axis with the cosines and sines at P Gauss points,

    rho(s) = (1 + eps) int_0^s (cos psi.q, sin psi.q) ds  ~  (1 + eps) sum_j W[s, j] (cos_j, sin_j),
    r(s) = r_I + Rot(theta) rho(s),     theta(s) = theta + psi(s).q .

Foreshortening, and with it the stiffness that axial load gives or takes (geometric stiffness), is in the cosines; nothing is
added for it. A part without geometric stiffness has (1, psi.q) in place of cosine and sine. Masses sit at the Gauss points.
Euler-Bernoulli beams in the floating frame: [Z] in `boom_twin.scene.notation`; the integrated form is derived here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...types import Array
from ..jit import inner
from ..plane_algebra import condense, condense_forces, cosines

BEAM = np.dtype(
    [
        ("z", np.int64),  # place of q among the unknowns; the axial strain follows the bending coordinates
        ("bending", np.int64),  # n
        ("axial", np.int64),  # 1 or 0
        ("points", np.int64),  # P
        ("finite", np.int64),  # P if cosine and sine of the rotations are taken, 0 if they are small: no geometric stiffness
        ("rotary", np.int64),  # P if cross-sections have rotary inertia, else 0
        ("damped", np.int64),  # number of coordinates if there is material damping, else 0
        ("history", np.int64),  # place of x, y of each point among the histories; then theta of each, if rotary
        ("beta", float),  # stiffness-proportional damping, s
        ("axial_stiffness", float),  # E A length, N m: energy is 1/2 of it times eps^2
    ]
)


class Sizes(NamedTuple):
    """Loop counts of a part, as the row has them: bending, axial, points."""

    bending: np.int64
    axial: np.int64
    points: np.int64


class BeamPart(NamedTuple):
    """Tables of a beam part, and its shape, which `beam_shape` fills.

    psi : (P+1, n); the last row, as those of all that follows with P+1 rows, belongs to the output end.
    weights : (P+1, P), m. stiffness : (n, n), N m. mass, rotary : (P,), kg and kg m^2.
    rho : (P+1, 2), m. drho : (P+1, n + axial, 2), its derivatives by q.
    turn : (P+1, 4) cosine, sine and their derivatives by the angle; of the output end the first two.
    """

    psi: Array
    weights: Array
    stiffness: Array
    mass: Array
    rotary: Array
    rho: Array
    drho: Array
    turn: Array


class BeamEquations(NamedTuple):
    """Equations of a part's q while it is condensed, and its gains afterwards (see `condense`).

    coupling : (>= n + axial, m) H_qe. block : (>= n + axial, ..) H_qq, lower triangle. force : (>= n + axial,) g_q.
    local : (P, 2) forces of the points' masses in the axes of the input end, N.
    """

    coupling: Array
    block: Array
    force: Array
    local: Array


USUAL = Sizes(np.int64(3), np.int64(1), np.int64(4))  # as constants, which the compiler unrolls: an eighth off a step


@inner
def is_usual(row):
    """Whether a part has the usual sizes."""
    return row.bending == USUAL.bending and row.axial == USUAL.axial and row.points == USUAL.points


@inner
def turn_points(row, part, sizes, z, angles):
    """Fill the part's `turn`, and `angles` (P+1,) of all cross-sections; returns the end's turn (rad)."""
    psi, turn, end = part.psi, part.turn, 0.0
    for j in range(sizes.points + 1):
        end = 0.0
        for k in range(sizes.bending):
            end += psi[j, k] * z[row.z + k]
        angles[j] = end
    if row.finite:
        cosines(angles, sizes.points + 1, turn)
        for j in range(sizes.points):
            turn[j, 2], turn[j, 3] = -turn[j, 1], turn[j, 0]
        return end
    for j in range(sizes.points):
        turn[j, 0], turn[j, 1], turn[j, 2], turn[j, 3] = 1.0, angles[j], 0.0, 1.0
    turn[sizes.points, 0], turn[sizes.points, 1] = math.cos(end), math.sin(end)
    return end


@inner
def beam_shape(row, part, sizes, z, angles):
    """Fill the part's shape, and `angles` (P+1,) of its cross-sections, from the unknowns z; returns the end's turn (rad)."""
    psi, weights, rho, drho, turn = part.psi, part.weights, part.rho, part.drho, part.turn
    n, stretch = sizes.bending, 1.0
    if sizes.axial:
        stretch += z[row.z + n]
    end = turn_points(row, part, sizes, z, angles)
    for i in range(sizes.points + 1):
        x, y = 0.0, 0.0
        for k in range(n):
            drho[i, k, 0], drho[i, k, 1] = 0.0, 0.0
        for j in range(sizes.points):
            weight = weights[i, j]
            x += weight * turn[j, 0]
            y += weight * turn[j, 1]
            dx, dy = stretch * weight * turn[j, 2], stretch * weight * turn[j, 3]
            for k in range(n):
                drho[i, k, 0] += dx * psi[j, k]
                drho[i, k, 1] += dy * psi[j, k]
        rho[i, 0], rho[i, 1] = stretch * x, stretch * y
        if sizes.axial:
            drho[i, n, 0], drho[i, n, 1] = x, y
    return end


@inner
def place_beam(row, part, sizes, angles, x, y, theta, c, s, position):
    """Write the points, and the cross-section angles if there is rotary inertia, into `position`."""
    rho = part.rho
    for i in range(sizes.points):
        at = row.history + 2 * i
        position[at] = x + c * rho[i, 0] - s * rho[i, 1]
        position[at + 1] = y + s * rho[i, 0] + c * rho[i, 1]
    for i in range(row.rotary):
        position[row.history + 2 * sizes.points + i] = theta + angles[i]


@inner
def transfer_beam(row, part, sizes, own, z, c, sn, motion, gravity, position, s, p, m):
    """Carry a cut (s, p) with m slots from the output to the input end, condensing q in `own`, a `BeamEquations`.

    c, sn : cos and sin of the input end's orientation.

    Returns the number of negative pivots, or -1.
    """
    n = sizes.bending
    size = n + sizes.axial
    fx, fy = c * p[0] + sn * p[1], -sn * p[0] + c * p[1]  # force at the output end in the axes of the input end
    if motion.renew:
        _pull_back_tangents(part, sizes, own, c, sn, fx, fy, s, p, m)
    _pull_back_forces(part, sizes, own, c, sn, p)
    _add_forces_of_points(row, part, sizes, own, c, sn, motion, gravity, position, p)
    _add_elastic_forces(row, part, sizes, own, z, motion)
    if not motion.renew:
        condense_forces(p, own.coupling, own.block, own.force, m, size)
        return 0
    _add_tangents_of_points(row, part, sizes, own, c, sn, motion, s)
    _add_bending_of_forces(row, part, sizes, own, fx, fy, 1.0 if size == n else 1.0 + z[row.z + n])
    _add_stiffness(row, part, sizes, own, motion)
    return condense(s, p, own.coupling, own.block, own.force, m, size)


@inner
def _pull_back_forces(part, sizes, own, c, sn, p):
    """Pull p at the output end back to e_I in place and to q in `own`."""
    psi, rho, drho, n, force = part.psi[sizes.points], part.rho[sizes.points], part.drho[sizes.points], sizes.bending, own.force
    for a in range(n + sizes.axial):
        ax, ay = drho[a, 0], drho[a, 1]
        bx, by = c * ax - sn * ay, sn * ax + c * ay
        turn = psi[a] if a < n else 0.0
        force[a] = bx * p[0] + by * p[1] + turn * p[2]
    ex, ey = c * rho[0] - sn * rho[1], sn * rho[0] + c * rho[1]
    p[2] += ex * p[1] - ey * p[0]


@inner
def _pull_back_tangents(part, sizes, own, c, sn, fx, fy, s, p, m):
    """Pull s at the output end back to (e_I, carried slots) in place and to q in `own`; force (fx, fy) there."""
    psi, rho, drho = part.psi[sizes.points], part.rho[sizes.points], part.drho[sizes.points]
    n, coupling, block = sizes.bending, own.coupling, own.block
    size = n + sizes.axial
    ex, ey = c * rho[0] - sn * rho[1], sn * rho[0] + c * rho[1]
    for a in range(size):
        ax, ay = drho[a, 0], drho[a, 1]
        bx, by = c * ax - sn * ay, sn * ax + c * ay
        turn = psi[a] if a < n else 0.0
        for i in range(m):
            coupling[a, i] = s[i, 0] * bx + s[i, 1] * by + s[i, 2] * turn
        h0, h1, h2 = coupling[a, 0], coupling[a, 1], coupling[a, 2]
        for b in range(a + 1):
            ox, oy = drho[b, 0], drho[b, 1]
            other = psi[b] if b < n else 0.0
            block[a, b] = h0 * (c * ox - sn * oy) + h1 * (sn * ox + c * oy) + h2 * other
        coupling[a, 2] = h2 + ex * h1 - ey * h0 + fy * ax - fx * ay
    bend = ex * p[0] + ey * p[1]
    for i in range(m):
        s[i, 2] += ex * s[i, 1] - ey * s[i, 0]
    for i in range(m):
        s[2, i] += ex * s[1, i] - ey * s[0, i]
    s[2, 2] -= bend


@inner
def _add_forces_of_points(row, part, sizes, own, c, sn, motion, gravity, position, p):
    """Add forces of the masses at the Gauss points; leave them in `own.local`, too."""
    psi, rho, drho, mass, rotary, force, local = part.psi, part.rho, part.drho, part.mass, part.rotary, own.force, own.local
    fx_all, fy_all, moment = 0.0, 0.0, 0.0
    for i in range(sizes.points):
        at = row.history + 2 * i
        inertial = mass[i] * motion.gain
        fx = inertial * (position[at] - motion.hat[at]) - mass[i] * gravity[0]
        fy = inertial * (position[at + 1] - motion.hat[at + 1]) - mass[i] * gravity[1]
        ux, uy = c * fx + sn * fy, c * fy - sn * fx
        local[i, 0], local[i, 1] = ux, uy
        fx_all += fx
        fy_all += fy
        moment += rho[i, 0] * uy - rho[i, 1] * ux
        for a in range(sizes.bending + sizes.axial):
            force[a] += ux * drho[i, a, 0] + uy * drho[i, a, 1]
    for i in range(row.rotary):
        at = row.history + 2 * sizes.points + i
        torque = rotary[i] * motion.gain * (position[at] - motion.hat[at])
        moment += torque
        for a in range(sizes.bending):
            force[a] += torque * psi[i, a]
    p[0] += fx_all
    p[1] += fy_all
    p[2] += moment


@inner
def _add_tangents_of_points(row, part, sizes, own, c, sn, motion, s):
    """Add tangents of the masses at the Gauss points, save second derivatives by two coordinates; forces in `own.local`.

    Into s only below its diagonal.
    """
    psi, rho, drho, mass, rotary = part.psi, part.rho, part.drho, part.mass, part.rotary
    coupling, block, local, n = own.coupling, own.block, own.local, sizes.bending
    size = n + sizes.axial
    total, lever_x, lever_y, turning = 0.0, 0.0, 0.0, 0.0
    for i in range(sizes.points):
        inertial = mass[i] * motion.gain
        x, y, ux, uy = rho[i, 0], rho[i, 1], local[i, 0], local[i, 1]
        total += inertial
        lever_x += inertial * (c * x - sn * y)
        lever_y += inertial * (sn * x + c * y)
        turning += inertial * (x * x + y * y) - (x * ux + y * uy)
        for a in range(size):
            ax, ay = drho[i, a, 0], drho[i, a, 1]
            mx, my = inertial * ax, inertial * ay
            coupling[a, 0] += c * mx - sn * my
            coupling[a, 1] += sn * mx + c * my
            coupling[a, 2] += x * my - y * mx + uy * ax - ux * ay
            for b in range(a + 1):
                block[a, b] += mx * drho[i, b, 0] + my * drho[i, b, 1]
    for i in range(row.rotary):
        inertial = rotary[i] * motion.gain
        turning += inertial
        for a in range(n):
            share = inertial * psi[i, a]
            coupling[a, 2] += share
            for b in range(a + 1):
                block[a, b] += share * psi[i, b]
    s[0, 0] += total
    s[1, 1] += total
    s[2, 0] -= lever_y
    s[2, 1] += lever_x
    s[2, 2] += turning


@inner
def _add_bending_of_forces(row, part, sizes, own, fx_end, fy_end, stretch):
    """Second derivatives of all positions by two coordinates, times the forces there: the geometric stiffness."""
    psi, weights, turn, local, block = part.psi, part.weights, part.turn, own.local, own.block
    n, points = sizes.bending, sizes.points
    for j in range(points):
        fx, fy = weights[points, j] * fx_end, weights[points, j] * fy_end
        for i in range(points):
            fx += weights[i, j] * local[i, 0]
            fy += weights[i, j] * local[i, 1]
        if j < row.finite:
            along = stretch * (fx * turn[j, 0] + fy * turn[j, 1])
            for a in range(n):
                share = along * psi[j, a]
                for b in range(a + 1):
                    block[a, b] -= share * psi[j, b]
        across = fx * turn[j, 2] + fy * turn[j, 3]
        for a in range(n * sizes.axial):
            block[n, a] += across * psi[j, a]


@inner
def _add_stiffness(row, part, sizes, own, motion):
    """Add tangents of `_add_elastic_forces`."""
    stiffness, block, n = part.stiffness, own.block, sizes.bending
    lead = 1.0 + row.beta * motion.rate
    for a in range(n):
        for b in range(a + 1):
            block[a, b] += lead * stiffness[a, b]
    if sizes.axial:
        block[n, n] += lead * row.axial_stiffness


@inner
def _add_elastic_forces(row, part, sizes, own, z, motion):
    """Add elastic forces and, where the row has damping, beta times the elastic force of the rates."""
    stiffness, force, n = part.stiffness, own.force, sizes.bending
    for a in range(n):
        for b in range(n):
            force[a] += stiffness[a, b] * z[row.z + b]
    if sizes.axial:
        force[n] += row.axial_stiffness * z[row.z + n]
    for b in range(row.damped):
        rate = row.beta * (motion.rate * z[row.z + b] + motion.offset[row.z + b])
        if b < n:
            for a in range(n):
                force[a] += stiffness[a, b] * rate
        else:
            force[n] += row.axial_stiffness * rate
