"""Quadrature and bases of the beam."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.kernels.elements import beam_shapes as modes


@pytest.mark.parametrize("count", [2, 5, 9])
def test_integration_is_exact_for_polynomials(count):
    points, weights = modes.gauss_points(count)
    matrix = modes.integration_matrix(count)
    ends = np.append(points, 1.0)
    for degree in range(count):
        assert matrix @ points**degree == pytest.approx(ends ** (degree + 1) / (degree + 1), abs=1e-13)
    assert weights @ points ** (2 * count - 1) == pytest.approx(1 / (2 * count), abs=1e-14)


@pytest.mark.parametrize("basis", [modes.end_shapes_and_bubbles, modes.cantilever_modes])
def test_curvature_is_the_slope_of_rotation(basis):
    n, count = 4, 24
    psi, curvature = basis(n, count)
    for k in range(n):
        assert modes.integration_matrix(count) @ curvature[:, k] == pytest.approx(psi[:, k], abs=1e-9)


def test_end_shapes_hold_every_linear_bending_moment():
    """Curvatures of the first two shapes span 1 and xi; further ones turn the end not at all and do not move it."""
    points, weights = modes.gauss_points(8)
    psi, curvature = modes.end_shapes_and_bubbles(5, 8)
    left = np.linalg.lstsq(curvature[:, :2], np.column_stack([np.ones(8), points]), rcond=None)[1]
    assert left == pytest.approx(0.0, abs=1e-25)
    assert psi[-1, 1:] == pytest.approx(0.0, abs=1e-14)
    assert weights @ psi[:-1, 2:] == pytest.approx(0.0, abs=1e-14)
    assert psi[-1, 0] == pytest.approx(1.0)


def test_stiffness():
    basis = modes.end_shapes_and_bubbles(4, 8)
    k = modes.bending_stiffness(basis, 5.0, 2.0)
    assert k == pytest.approx(np.diag(5.0 / 2.0 / (2 * np.arange(4) + 1)), abs=1e-13)


def test_cantilever_shapes_have_free_ends():
    psi, curvature = modes.cantilever_modes(3, 60)
    points, _ = modes.gauss_points(60)
    assert psi[-1] == pytest.approx(1.0)
    slope_at_end = np.polynomial.Polynomial.fit(points, curvature[:, 0], 20)
    assert slope_at_end(1.0) == pytest.approx(0.0, abs=1e-6)
    assert slope_at_end.deriv()(1.0) == pytest.approx(0.0, abs=1e-4)
