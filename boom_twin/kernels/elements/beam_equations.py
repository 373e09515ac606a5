"""Equations of a flexible beam part: forces and tangents along its coordinates q, condensed while a cut is carried over it.

Kinematics, coordinates and notation: `kernels.elements.beam`.
"""

from __future__ import annotations

from typing import NamedTuple

from ...types import Array
from ..jit import inner
from ..plane_algebra import COS, SIN, condense, condense_forces
from .beam import D_COS, D_SIN, stretch_of

FX, FY, TORQUE, CARRIED_X, CARRIED_Y, STRAIN, ALONG_Q, LOCAL_ROWS = range(8)  # rows of `BeamEquations.local`


class BeamEquations(NamedTuple):
    """Equations of a part's q while it is condensed, and its gains afterwards (see `condense`).

    Rows of `local` (LOCAL_ROWS, >= P, >= n + axial), in the axes of the input end: of the Gauss points, force of their masses
    (N), torque (N m), force that they carry (N); of the coordinates, the strains that give elastic forces, and g_q.
    """

    coupling: Array  # (>= n + axial, m), H_qe
    block: Array  # (>= n + axial, ..), H_qq, lower triangle
    force: Array  # (>= n + axial,), g_q
    local: Array


@inner
def shape_derivatives(part, sizes, stretch):
    """Fill the part's `drho` from its `turn` and `rho`; only tangents need it."""
    psi, weights, rho, drho, turn, n = part.psi, part.weights, part.rho, part.drho, part.turn, sizes.bending
    for i in range(sizes.points + 1):
        for k in range(n):
            drho[i, k, 0], drho[i, k, 1] = 0.0, 0.0
        for j in range(sizes.points):
            weight = stretch * weights[i, j]
            dx, dy = weight * turn[D_COS, j], weight * turn[D_SIN, j]
            for k in range(n):
                drho[i, k, 0] += dx * psi[j, k]
                drho[i, k, 1] += dy * psi[j, k]
        if sizes.axial:
            drho[i, n, 0], drho[i, n, 1] = rho[i, 0] / stretch, rho[i, 1] / stretch


@inner
def transfer_beam(row, part, sizes, own, z, c, sn, motion, gravity, position, s, p, m):
    """Carry a cut (s, p) with m slots from the output to the input end, condensing q in `own`, a `BeamEquations`.

    The input end has the orientation of cosine `c` and sine `sn`. Return the number of negative pivots, or -1.
    """
    q = z[row.z : row.z + row.bending + row.axial]
    size, stretch = sizes.bending + sizes.axial, stretch_of(sizes, q)
    fx, fy = c * p[0] + sn * p[1], -sn * p[0] + c * p[1]  # force at the output end in the axes of the input end
    if motion.renew:
        shape_derivatives(part, sizes, stretch)
        _pull_back_tangents(part, sizes, own, c, sn, fx, fy, s, p, m)
    torque = p[2]
    _add_forces_to_cut(row, part, sizes, own, c, sn, motion, gravity, position, p)
    _add_elastic_forces(row, part, sizes, own, q, motion)
    _add_forces_to_coordinates(part, sizes, own, fx, fy, torque, stretch)
    if not motion.renew:
        condense_forces(p, own.coupling, own.block, own.local[ALONG_Q], m, size)
    for a in range(size):
        own.force[a] = own.local[ALONG_Q, a]
    if not motion.renew:
        return 0
    _add_tangents_of_points(row, part, sizes, own, c, sn, motion, s)
    _add_bending_of_forces(row, part, sizes, own, stretch)
    _add_stiffness(row, part, sizes, own, motion)
    return condense(s, p, own.coupling, own.block, own.force, m, size)


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
def _add_forces_to_cut(row, part, sizes, own, c, sn, motion, gravity, position, p):
    """Move p from the output end to e_I and add the points' masses; their forces are left in `own.local`."""
    rho, mass, local, end = part.rho, part.mass, own.local, sizes.points
    first, behind = row.history, row.history + 2 * row.points + row.rotary
    points, hat = position[first:behind], motion.hat[first:behind]  # views: places in them need no check for being negative
    ex, ey = c * rho[end, 0] - sn * rho[end, 1], sn * rho[end, 0] + c * rho[end, 1]
    fx_all, fy_all, moment = p[0], p[1], p[2] + ex * p[1] - ey * p[0]
    for i in range(sizes.points):
        fx = mass[i] * (motion.gain * (points[2 * i] - hat[2 * i]) - gravity[0])
        fy = mass[i] * (motion.gain * (points[2 * i + 1] - hat[2 * i + 1]) - gravity[1])
        ux, uy = c * fx + sn * fy, c * fy - sn * fx
        local[FX, i], local[FY, i], local[TORQUE, i] = ux, uy, 0.0
        fx_all += fx
        fy_all += fy
        moment += rho[i, 0] * uy - rho[i, 1] * ux
    if row.rotary:
        for i in range(end):
            torque = part.rotary[i] * motion.gain * (points[2 * end + i] - hat[2 * end + i])
            local[TORQUE, i] = torque
            moment += torque
    p[0], p[1], p[2] = fx_all, fy_all, moment


@inner
def _add_elastic_forces(row, part, sizes, own, q, motion):
    """Begin g_q with elastic forces and, where the row has damping, beta times the elastic force of the rates."""
    stiffness, local, n = part.stiffness, own.local, sizes.bending
    for b in range(n + sizes.axial):
        local[STRAIN, b] = q[b]
    if row.damped:
        offset = motion.offset[row.z : row.z + row.damped]
        for b in range(n + sizes.axial):
            local[STRAIN, b] += row.beta * (motion.rate * q[b] + offset[b])
    for a in range(n):
        value = stiffness[a, 0] * local[STRAIN, 0]
        for b in range(1, n):
            value += stiffness[a, b] * local[STRAIN, b]
        local[ALONG_Q, a] = value
    if sizes.axial:
        local[ALONG_Q, n] = row.axial_stiffness * local[STRAIN, n]


@inner
def _add_forces_to_coordinates(part, sizes, own, fx_end, fy_end, torque_end, stretch):
    """Add to g_q what the end's force and torque and those in `own.local` do along q.

    The derivatives of all positions are not needed for it: each force first goes to the Gauss points that carry it, whose sums
    turn there, F_j = sum_i W[i, j] f_i.
    """
    psi, weights, rho, turn, local = part.psi, part.weights, part.rho, part.turn, own.local
    n, end = sizes.bending, sizes.points
    along = fx_end * rho[end, 0] + fy_end * rho[end, 1]
    for j in range(end):
        fx, fy = weights[end, j] * fx_end, weights[end, j] * fy_end
        for i in range(end):
            fx += weights[i, j] * local[FX, i]
            fy += weights[i, j] * local[FY, i]
        local[CARRIED_X, j], local[CARRIED_Y, j] = fx, fy
        local[TORQUE, j] += stretch * (fx * turn[D_COS, j] + fy * turn[D_SIN, j])
        along += local[FX, j] * rho[j, 0] + local[FY, j] * rho[j, 1]
    for a in range(n):
        value = local[ALONG_Q, a] + psi[end, a] * torque_end
        for j in range(end):
            value += psi[j, a] * local[TORQUE, j]
        local[ALONG_Q, a] = value
    if sizes.axial:
        local[ALONG_Q, n] += along / stretch


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
        x, y, ux, uy = rho[i, 0], rho[i, 1], local[FX, i], local[FY, i]
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
def _add_bending_of_forces(row, part, sizes, own, stretch):
    """Second derivatives of all positions by two coordinates, times the forces there: the geometric stiffness."""
    psi, turn, local, block, n = part.psi, part.turn, own.local, own.block, sizes.bending
    for j in range(sizes.points):
        fx, fy = local[CARRIED_X, j], local[CARRIED_Y, j]
        if j < row.finite:
            along = stretch * (fx * turn[COS, j] + fy * turn[SIN, j])
            for a in range(n):
                share = along * psi[j, a]
                for b in range(a + 1):
                    block[a, b] -= share * psi[j, b]
        across = fx * turn[D_COS, j] + fy * turn[D_SIN, j]
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
