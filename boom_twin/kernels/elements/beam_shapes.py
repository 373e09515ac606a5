"""Bases for the bending of a beam part: rotation shapes psi, their stiffness, and the quadrature along the axis.

Shapes are functions of xi = s/length in [0, 1] with psi(0) = 0. Only these numbers reach the kernels; a basis is a choice of
tables, not of code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ...types import Array


class Basis(NamedTuple):
    """psi (P+1, n), last row at the output end; curvature psi' at the P points (P, n), per unit of xi."""

    psi: Array
    curvature: Array


def gauss_points(count: int) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights on [0, 1], both shape (count,)."""
    points, weights = legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights


def integration_matrix(count: int) -> Array:
    """Shape (count + 1, count): integrals from 0 to each Gauss point, and to 1, of a function known at the points.

    Exact for polynomials of degree count - 1, the last row for 2 count - 1.
    """
    points, weights = gauss_points(count)
    return np.vstack([integrals_to(count, points), weights])


def integrals_to(count: int, places: Array) -> Array:
    """Shape (places, count): integrals from 0 to each of the `places` in [0, 1] of a function known at the Gauss points."""
    points, _ = gauss_points(count)
    values = legendre.legvander(2.0 * points - 1.0, count - 1)
    return np.asarray(np.linalg.solve(values.T, rotations_at(count, places).T).T)


def rotations_at(n: int, places: Array) -> Array:
    """Shape (places, n): psi of the default basis at the `places` in [0, 1]."""
    return np.stack([legendre.legval(2.0 * places - 1.0, _integral(k)) for k in range(n)], axis=1)


def _integral(degree: int) -> Array:
    """Legendre coefficients of the integral over xi from 0 of the Legendre polynomial of `degree` in 2 xi - 1."""
    return 0.5 * legendre.legint(np.eye(degree + 1)[degree], lbnd=-1)


def end_shapes_and_bubbles(n: int, count: int) -> Basis:
    """Curvature in Legendre polynomials: the default basis.

    n = 2 spans the two cubic end shapes, exact for end forces and torques; every further coordinate adds one shape that
    leaves the ends in place. Coordinate 1 is the rotation of the output end; the stiffness is diagonal.
    """
    points, _ = gauss_points(count)
    ends = np.append(points, 1.0)
    return Basis(rotations_at(n, ends), np.asarray(legendre.legvander(2.0 * points - 1.0, n - 1), float))


CANTILEVER_ROOTS = (1.87510407, 4.69409113, 7.85475744, 10.99554073)


def cantilever_modes(n: int, count: int) -> Basis:
    """Rotation of the cantilever's natural modes, scaled to psi(1) = 1: the papers' choice [Z].

    beta L solves cos x cosh x = -1; beyond the fourth, (2k - 1) pi/2 to machine precision.
    """
    points, _ = gauss_points(count)
    ends = np.append(points, 1.0)
    psi, curvature = [], []
    for k in range(n):
        b = CANTILEVER_ROOTS[k] if k < len(CANTILEVER_ROOTS) else (2 * k + 1) * np.pi / 2
        ratio = (np.sinh(b) - np.sin(b)) / (np.cosh(b) + np.cos(b))
        slope = np.sinh(b * ends) + np.sin(b * ends) - ratio * (np.cosh(b * ends) - np.cos(b * ends))
        bend = b * (np.cosh(b * points) + np.cos(b * points) - ratio * (np.sinh(b * points) + np.sin(b * points)))
        psi.append(slope / slope[-1])
        curvature.append(bend / slope[-1])
    return Basis(np.stack(psi, axis=1), np.stack(curvature, axis=1))


def bending_stiffness(basis: Basis, rigidity: float, length: float) -> Array:
    """K (n, n) in N m: energy is 1/2 q.K q, for rigidity E I (N m^2) and length (m)."""
    _, weights = gauss_points(len(basis.curvature))
    return np.asarray(rigidity / length * np.einsum("p,pa,pb->ab", weights, basis.curvature, basis.curvature))
