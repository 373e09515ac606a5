"""Flexible beam part in a floating frame at its input end I: Euler-Bernoulli, exact in rotation, static axial stretch.

Coordinates q: n bending ones and, if the row says so, one axial strain eps. The cross-section at arc s is turned by
psi(s).q against the input end, psi(0) = 0; the curvature is psi'(s).q, so bending energy is quadratic, 1/2 q.K q, for any
rotation. Positions follow by integration along the axis with the cosines and sines at P Gauss points,

    rho(s) = (1 + eps) int_0^s (cos psi.q, sin psi.q) ds  ~  (1 + eps) sum_j W[s, j] (cos_j, sin_j),
    r(s) = r_I + Rot(theta) rho(s),     theta(s) = theta + psi(s).q .

Foreshortening, and with it the stiffness that axial load gives or takes (geometric stiffness), is in the cosines; nothing is
added for it. A part without geometric stiffness has (1, psi.q) in place of cosine and sine. Masses sit at the Gauss points.
Euler-Bernoulli beams in the floating frame: [Z] in `boom_twin.kernels`; the integrated form is derived here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...types import Array
from ..jit import inner
from ..plane_algebra import COS, SIN, cosine_and_sine, cosines

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


class Sizes(NamedTuple):
    """Loop counts of a part, as the row has them: bending, axial, points. As numbers they need no load in a loop."""

    bending: np.int64
    axial: np.int64
    points: np.int64


class BeamPart(NamedTuple):
    """Tables of a beam part, and its shape, which `beam_shape` fills; the last of P+1 rows is the output end's."""

    psi: Array  # (P+1, n)
    weights: Array  # (P+1, P), m
    stiffness: Array  # (n, n), N m
    mass: Array  # (P,), kg
    rotary: Array  # (P,), kg m^2
    rho: Array  # (P+1, 2), m
    drho: Array  # (P+1, n + axial, 2), its derivatives by q
    turn: Array  # (TURN_ROWS, P+1), cosine, sine, their derivatives by the angle (not of the output end), angle


@inner
def turn_points(row, part, sizes, q):
    """Fill the part's `turn`; returns the end's turn (rad)."""
    psi, turn, end = part.psi, part.turn, sizes.points
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
def beam_shape(row, part, sizes, z):
    """Fill the part's `turn` and `rho` from the unknowns z; returns the end's turn (rad)."""
    q = z[row.z : row.z + row.bending + row.axial]
    weights, turn, rho, stretch = part.weights, part.turn, part.rho, stretch_of(sizes, q)
    end = turn_points(row, part, sizes, q)
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
def place_beam(row, part, sizes, z, x, y, theta, c, s, position):
    """Shape and place a part whose input end is at (x, y), turned by theta (cosine c, sine s); return the end's turn (rad).

    Writes the part's `turn` and `rho`, and into `position` the points, and the angles there if there is rotary inertia.
    """
    end, points = beam_shape(row, part, sizes, z), position[row.history : row.history + 2 * row.points + row.rotary]
    turn, rho = part.turn, part.rho
    for i in range(sizes.points):
        points[2 * i] = x + c * rho[i, 0] - s * rho[i, 1]
        points[2 * i + 1] = y + s * rho[i, 0] + c * rho[i, 1]
    if row.rotary:
        for i in range(sizes.points):
            points[2 * sizes.points + i] = theta + turn[ANGLE, i]
    return end
