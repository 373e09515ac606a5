"""What `boom_twin.health.inference.hypotheses` does with evidence, compiled: adding blocks, integrating out, fitting faults."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...kernels.jit import inner, kernel
from ...types import Array
from .normal_distribution import log_below

TINY = 1e-14  # share of a variance: what is left of it below that is none
GROWING_PRIOR, GROWN = 1e-4, 10.0  # weight of a fault that grows; time (s) in which it grows to its size
EARLY = 0.25  # share of the span at which growth has its least value, too; a line through growth from halfway on has 0 there


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


class Faults(NamedTuple):
    """What `fit_faults` has to know of f faults, g of which may grow.

    Attributes
    ----------
    places, usual2 : ndarray, shape (f,)
        Of their parameters; variance of what they usually are.
    is_boundless : ndarray of bool, shape (f,)
        Whether they may be of any size, that is the least of what they usually are.
    least, none_sided : ndarray, shape (f,)
        Least values; ln of the probability that what they usually are is above them.
    grows, rates : ndarray, shape (g,)
        Which of them may grow, and the places of their rates.
    """

    places: NDArray[np.int64]
    usual2: Array
    is_boundless: NDArray[np.bool_]
    least: Array
    none_sided: Array
    grows: NDArray[np.int64]
    rates: NDArray[np.int64]


@kernel
def fit_faults(f, matrix, vector, span, found):
    """Explain evidence by each of f faults that is as large all the time, then by each of g that grows; l levels of the load.

    What grows has its least value early on, too, and what has no least value had the same sign then: nothing grows through 0.
    Else an onset within the evidence is a line through 0 for a sensor, but not for a spring.

    Parameters
    ----------
    f : Faults
    matrix, vector : ndarray, shape (l, c, c), (l, c)
        L' and l', see `boom_twin.health.inference.hypotheses`.
    span : float
        Time (s) that the evidence has taken.
    found : ndarray, shape (l, 6, f + g)
        Written: log factor, squares that are explained, value and its deviation at the end, rate (1/s) and its deviation.
    """
    count = f.places.shape[0]
    for level in range(vector.shape[0]):
        for a in range(count):
            fit_steady(f, a, matrix[level], vector[level], found[level, :, a])
        for b in range(f.grows.shape[0]):
            fit_growing(f, b, matrix[level], vector[level], span, found[level, :, count + b])


@inner
def fit_steady(f, a, matrix, vector, found):
    """Explain evidence of one level by fault `a`, as large all the time; see `fit_faults`."""
    known, by, usual2 = matrix[f.places[a], f.places[a]], vector[f.places[a]], f.usual2[a]
    if f.is_boundless[a] and known > 0.0:
        usual2 = max(usual2, (by / known) * (by / known) - 1.0 / known)
    spread = usual2 / (1.0 + usual2 * known)
    value, sigma = spread * by, math.sqrt(spread)
    found[0] = 0.5 * by * value - 0.5 * math.log1p(usual2 * known) + sided(f, a, value, sigma)
    found[1], found[2], found[3], found[4], found[5] = by * value, value, sigma, 0.0, 0.0


@inner
def fit_growing(f, b, matrix, vector, span, found):
    """Explain evidence of one level by fault number `b` of those that may grow; see `fit_faults`."""
    a, rate = f.grows[b], f.rates[b]
    place, size2 = f.places[a], f.usual2[a]
    rate2, across = size2 / GROWN**2, size2 / GROWN
    own, other = 1.0 + size2 * matrix[place, place], 1.0 + rate2 * matrix[rate, rate]
    both = across * matrix[place, rate]
    det = own * other - both * both
    first2, mixed, second2 = size2 * other / det, -across * both / det, rate2 * own / det  # covariance of value and rate
    first = first2 * vector[place] + mixed * vector[rate]
    second = mixed * vector[place] + second2 * vector[rate]
    explained, early = vector[place] * first + vector[rate] * second, EARLY * span
    value, sigma = first + span * second, math.sqrt(first2 + 2.0 * span * mixed + span * span * second2)
    once, once_sigma = first + early * second, math.sqrt(first2 + 2.0 * early * mixed + early * early * second2)
    if math.isinf(f.least[a]):
        lessened = log_below(math.copysign(1.0, value) * once / once_sigma) + math.log(2.0)
    else:
        lessened = min(sided(f, a, value, sigma), sided(f, a, once, once_sigma))
    found[0] = 0.5 * explained - 0.5 * math.log(det) + lessened + math.log(GROWING_PRIOR)
    found[1], found[2], found[3], found[4], found[5] = explained, value, sigma, second, math.sqrt(second2)


@inner
def sided(f, a, value, sigma):
    """What it adds to the log factor that fault `a` has a least value."""
    return log_below((value - f.least[a]) / sigma) - f.none_sided[a]
