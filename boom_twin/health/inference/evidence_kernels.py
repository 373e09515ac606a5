"""What `boom_twin.health.inference.hypotheses` does with evidence, compiled: adding blocks, integrating parameters out."""

from __future__ import annotations

import math

from ...kernels.jit import inner, kernel

TINY = 1e-14  # share of a variance: what is left of it below that is none


@kernel
def add_rows(matrix, vector, squares, white, weight, new_matrix, new_vector, new_squares):
    """Add what whitened innovations say to evidence, `weight` times; l levels of the load, k coefficients.

    Parameters
    ----------
    matrix, vector, squares : ndarray, shape (l, k, k), (l, k), (l,)
        See `boom_twin.health.inference.hypotheses.Evidence`.
    white : ndarray, shape (l, rows, 1 + k)
        See `boom_twin.health.inference.innovation_filter.Innovations`.
    new_matrix, new_vector, new_squares : ndarray
        Written, of the same shapes.
    """
    count = vector.shape[1]
    for level in range(vector.shape[0]):
        new_squares[level] = squares[level]
        for t in range(white.shape[1]):
            new_squares[level] += weight * (white[level, t, 0] * white[level, t, 0])
        for i in range(count):
            new_vector[level, i] = vector[level, i]
            for c in range(count):
                new_matrix[level, i, c] = matrix[level, i, c]
            for t in range(white.shape[1]):
                by = weight * white[level, t, 1 + i]
                new_vector[level, i] += by * white[level, t, 0]
                for c in range(count):
                    new_matrix[level, i, c] += by * white[level, t, 1 + c]


@kernel
def integrate_out(matrix, vector, mean, covariance, root, across, spread, left, reduced, fitted, log_det):
    """Integrate healthy deviations of the first k of c coefficients out of evidence; l levels of the load.

    With R R' = P, the covariance, and U' U = I + R' L R, what is taken from L is W' W, where W = U'^-1 R' L.

    Parameters
    ----------
    matrix, vector : ndarray, shape (l, c, c), (l, c)
        L and l.
    mean, covariance : ndarray, shape (k,), (k, k)
    root, across, spread : ndarray, shape (k, k), (k, c + 1), (k, k)
        Scratch.
    left, reduced : ndarray, shape (l, c, c), (l, c)
        Written: L' and l', see `boom_twin.health.inference.hypotheses`.
    fitted, log_det : ndarray, shape (l,)
        Written: squares that the deviations explain, ln of the determinant of I + P L.
    """
    rank = write_root(covariance, root)
    count, healthy = vector.shape[1], mean.shape[0]
    for level in range(vector.shape[0]):
        fitted[level] = 0.0
        for i in range(count):
            reduced[level, i] = vector[level, i]
            for c in range(count):
                left[level, i, c] = matrix[level, i, c]
        for j in range(healthy):
            if mean[j] != 0.0:
                for c in range(count):
                    reduced[level, c] -= mean[j] * matrix[level, j, c]
        for j in range(healthy):
            fitted[level] += (vector[level, j] + reduced[level, j]) * mean[j]
        write_across(matrix[level], reduced[level], root, rank, across, spread)
        log_det[level] = 0.0
        for j in range(rank):
            log_det[level] += math.log(spread[j, j])
            eliminate(spread, across, j, rank)
            fitted[level] += across[j, count] * across[j, count]
        for i in range(count):
            for j in range(rank):
                by = across[j, i]
                reduced[level, i] -= by * across[j, count]
                for c in range(i + 1):
                    left[level, i, c] -= by * across[j, c]
            for c in range(i):
                left[level, c, i] = left[level, i, c]


@inner
def write_root(covariance, root):
    """Write a root R of a covariance that may be singular, R R'; gives its columns, as many as the rank."""
    size, rank = covariance.shape[0], 0
    for j in range(size):
        pivot = covariance[j, j]
        for a in range(rank):
            pivot -= root[j, a] * root[j, a]
        if not pivot > TINY * covariance[j, j]:
            continue
        for i in range(j):
            root[i, rank] = 0.0
        root[j, rank] = math.sqrt(pivot)
        for i in range(j + 1, size):
            rest = covariance[i, j]
            for a in range(rank):
                rest -= root[i, a] * root[j, a]
            root[i, rank] = rest / root[j, rank]
        rank += 1
    return rank


@inner
def write_across(matrix, vector, root, rank, across, spread):
    """Write R' L, with R' l in a last column, and the upper triangle of I + R' L R."""
    size, count = root.shape[0], vector.shape[0]
    for a in range(rank):
        for c in range(count + 1):
            across[a, c] = 0.0
        for b in range(rank):
            spread[a, b] = 0.0
        spread[a, a] = 1.0
        for j in range(size):
            by = root[j, a]
            if by != 0.0:
                for c in range(count):
                    across[a, c] += by * matrix[j, c]
                across[a, count] += by * vector[j]
        for j in range(size):
            by = across[a, j]
            for b in range(a, rank):
                spread[a, b] += by * root[j, b]


@inner
def eliminate(spread, across, j, rank):
    """Step j of U' U = `spread`, of which the upper triangle is given, and of U'^-1 times `across`; both in place."""
    size = math.sqrt(spread[j, j])
    for b in range(j, rank):
        spread[j, b] /= size
    for c in range(across.shape[1]):
        across[j, c] /= size
    for i in range(j + 1, rank):
        by = spread[j, i]
        for b in range(i, rank):
            spread[i, b] -= by * spread[j, b]
        for c in range(across.shape[1]):
            across[i, c] -= by * across[j, c]
