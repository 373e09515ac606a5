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

from typing import NamedTuple

import numpy as np

from ...types import Array
from ..jit import StackArray, inner
from ..plane_algebra import COS, SIN, condense, condense_forces, cosine_and_sine, cosines

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

D_COS, D_SIN, ANGLE, TURN_ROWS = 2, 3, 4, 5  # rows of `BeamPart.turn`, behind COS and SIN
FX, FY, TORQUE, CARRIED_X, CARRIED_Y, STRAIN, ALONG_Q, LOCAL_ROWS = range(8)  # rows of `BeamEquations.local`


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
    turn : (TURN_ROWS, P+1) cosine, sine, their derivatives by the angle (not of the output end), angle.
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
    local : (LOCAL_ROWS, >= P, >= n + axial) of the Gauss points, forces in the axes of the input end: force of their masses
        (N), torque (N m), force that they carry (N); and of the coordinates, the strains that give elastic forces, and g_q.
    """

    coupling: Array
    block: Array
    force: Array
    local: Array


USUAL = Sizes(np.int64(3), np.int64(1), np.int64(4))  # as constants, which the compiler unrolls
USUAL_TURN, USUAL_RHO, USUAL_LOCAL = StackArray(TURN_ROWS, 5), StackArray(5, 2), StackArray(LOCAL_ROWS, 4)


@inner
def is_usual(row):
    """Return True if a part has the usual sizes."""
    return row.bending == USUAL.bending and row.axial == USUAL.axial and row.points == USUAL.points


@inner
def turn_points(row, part, sizes, q, turn):
    """Fill `turn`, see `BeamPart`; returns the end's turn (rad)."""
    psi, end = part.psi, sizes.points
    for j in range(end + 1):
        angle = 0.0
        for k in range(sizes.bending):
            angle += psi[j, k] * q[k]
        turn[ANGLE, j] = angle
    if row.finite:
        cosines(turn[ANGLE], end + 1, turn)
        for j in range(end):
            turn[D_COS, j], turn[D_SIN, j] = -turn[SIN, j], turn[COS, j]
        return turn[ANGLE, end]
    for j in range(end):
        turn[COS, j], turn[SIN, j], turn[D_COS, j], turn[D_SIN, j] = 1.0, turn[ANGLE, j], 0.0, 1.0
    turn[COS, end], turn[SIN, end] = cosine_and_sine(turn[ANGLE, end])
    return turn[ANGLE, end]


@inner
def stretch_of(sizes, q):
    """Return the stretch 1 + eps, or 1 for a part without axial strain."""
    return 1.0 + q[sizes.bending] if sizes.axial else 1.0


@inner
def beam_shape(row, part, sizes, z, turn, rho):
    """Fill `turn` and `rho`, see `BeamPart`, from the unknowns z; returns the end's turn (rad)."""
    q = z[row.z : row.z + row.bending + row.axial]
    weights, stretch = part.weights, stretch_of(sizes, q)
    end = turn_points(row, part, sizes, q, turn)
    for i in range(sizes.points + 1):
        x, y = 0.0, 0.0
        for j in range(sizes.points):
            x += weights[i, j] * turn[COS, j]
            y += weights[i, j] * turn[SIN, j]
        rho[i, 0], rho[i, 1] = stretch * x, stretch * y
    return end


@inner
def point_on_axis(row, part_psi, z, psi, weights):
    """Return place (m) and rotation (rad) of a point of a part in the frame of its input end.

    `part_psi` (P+1, n) is that of the part, `psi` (n,) the rotation at the point by the coordinates, `weights` (P,) the
    integral from the input end to it by the values at the Gauss points, m.
    """
    x, y, turn = 0.0, 0.0, 0.0
    for j in range(row.points):
        angle = 0.0
        for k in range(row.bending):
            angle += part_psi[j, k] * z[row.z + k]
        c, s = cosine_and_sine(angle) if row.finite else (1.0, angle)
        x += weights[j] * c
        y += weights[j] * s
    for k in range(row.bending):
        turn += psi[k] * z[row.z + k]
    stretch = 1.0 + z[row.z + row.bending] if row.axial else 1.0
    return stretch * x, stretch * y, turn


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
def place_beam(row, part, sizes, z, x, y, theta, c, s, position, turn, rho):
    """Shape and place a part whose input end is at (x, y), turned by theta (cosine c, sine s); return the end's turn (rad).

    Writes the part's `turn` and `rho`, and into `position` the points, and the angles there if there is rotary inertia. The
    arguments `turn` and `rho` are room for them while they are worked out: the part's own, or on the stack.
    """
    end, points = beam_shape(row, part, sizes, z, turn, rho), position[row.history : row.history + 2 * row.points + row.rotary]
    for i in range(sizes.points):
        points[2 * i] = x + c * rho[i, 0] - s * rho[i, 1]
        points[2 * i + 1] = y + s * rho[i, 0] + c * rho[i, 1]
    if row.rotary:
        for i in range(sizes.points):
            points[2 * sizes.points + i] = theta + turn[ANGLE, i]
    for i in range(sizes.points + 1):
        part.rho[i, 0], part.rho[i, 1] = rho[i, 0], rho[i, 1]
    for k in range(TURN_ROWS):
        for j in range(sizes.points + 1):
            part.turn[k, j] = turn[k, j]
    return end


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
